"""The validation report as one HTML page: the Markdown rendered, figures embedded, verdicts in colour."""

from __future__ import annotations

import base64
import re
from pathlib import Path

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2em; border-bottom: 1px solid #ddd; padding-bottom: .2em; }
table { border-collapse: collapse; font-size: 13px; margin: 1em 0; display: block; overflow-x: auto; }
th, td { border-bottom: 1px solid #e4e4e4; padding: .25em .6em; text-align: left; vertical-align: top; }
th { background: #f5f6f8; position: sticky; top: 0; }
img { max-width: 100%; height: auto; } code { background: #f5f6f8; padding: 0 .2em; }
td.agrees { color: #1b6e34; } td.differs { color: #a8321e; font-weight: 600; } td.untestable { color: #777; }
"""
_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title><style>{style}</style></head>
<body>
{body}</body></html>
"""
_CLASSES = (("agrees", "agrees"), ("differs", "differs"), ("cannot be tested", "untestable"))


def page(markdown: str, folder: Path, title: str) -> str:
    """Return a self-contained page of Markdown whose images stand in `folder`."""
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(markdown)
    for start, name in _CLASSES:
        body = body.replace(f"<td>{start}", f'<td class="{name}">{start}')
    body = re.sub(r"<h3>(\w+)</h3>", lambda m: f'<h3 id="{m[1].lower()}">{m[1]}</h3>', body)
    body = re.sub(r'<img src="([^"]+)"', lambda m: f'<img src="{_embedded(folder / m[1])}"', body)
    return _PAGE.format(title=title, style=_STYLE, body=body)


def _embedded(picture: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(picture.read_bytes()).decode("ascii")
