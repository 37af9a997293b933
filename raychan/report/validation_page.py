"""The validation report as an HTML page beside its figures: the Markdown rendered, verdicts in colour."""

from __future__ import annotations

import re
import struct
from pathlib import Path

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2em; border-bottom: 1px solid #ddd; padding-bottom: .2em; }
table { border-collapse: collapse; font-size: 13px; margin: 1em 0; display: block; overflow-x: auto; }
th, td { border-bottom: 1px solid #e4e4e4; padding: .25em .6em; text-align: left; vertical-align: top; }
td { max-width: 34em; } td:first-child { white-space: nowrap; }
th { background: #f5f6f8; }
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


_SHOWN = 0.6  # CSS pixels for a dot of a figure: text in figures is then as large as on the page


def page(markdown: str, folder: Path, title: str) -> str:
    """Return the page of Markdown; its images are in `folder`, where the page is to be written too."""
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(markdown)
    for start, name in _CLASSES:
        body = body.replace(f"<td>{start}", f'<td class="{name}">{start}')
    body = re.sub(r"<(h[23])>([^<]+)</", lambda m: f'<{m[1]} id="{anchor(m[2])}">{m[2]}</', body)
    body = re.sub(r'<img src="([^"]+)"', lambda m: f'{m[0]} width="{_SHOWN * _wide(folder / m[1]):.0f}"', body)
    return _PAGE.format(title=title, style=_STYLE, body=body)


def anchor(heading: str) -> str:
    """Return the name by which links reach a heading, as GitHub makes it."""
    return re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")


def _wide(picture: Path) -> int:
    """Return the width of a PNG in dots, from its header."""
    return int(struct.unpack(">I", picture.read_bytes()[16:20])[0])
