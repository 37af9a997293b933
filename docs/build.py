"""Build the pages of docs/ and the API reference: python docs/build.py out/docs. Every warning is an error.

The pages are the Markdown files as they stand, rendered by markdown-it; the reference is made by pdoc from the
docstrings of the public names and of the records.
"""

from __future__ import annotations

import dataclasses
import importlib
import re
import shutil
import sys
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

from markdown_it import MarkdownIt

HERE = Path(__file__).parent
ROOT = HERE.parent
MODULES = ("raychan", "raychan.records")
TUTORIALS = ("first_scene", "own_mesh", "hidden_pedestrian", "ghost", "sweep", "own_waveform")
MENU = (
    ("Start", ("index.md",)),
    (
        "Tutorials",
        tuple(f"tutorials/{name}.md" for name in TUTORIALS),
    ),
    (
        "Look up",
        ("command_line.md", "scene_files.md", "gallery.md", "conventions.md", "laser.md", "hil.md", "glossary.md"),
    ),
    ("Trust", ("theory.md", "ship.md", "accuracy.md", "limits.md", "measurements.md")),
    ("Project", ("../CONTRIBUTING.md", "../CHANGELOG.md")),
)
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; margin: 0; display: flex; }
nav { flex: 0 0 15em; min-height: 100vh; background: #f5f6f8; padding: 1.5em; box-sizing: border-box; font-size: 14px; }
nav b { display: block; margin: 1.2em 0 .2em; } nav a { display: block; padding: .1em 0; }
nav a.here { font-weight: 600; color: #222; }
main { flex: 1; min-width: 0; max-width: 60em; padding: 1.5em 2.5em 4em; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2em; border-bottom: 1px solid #ddd; padding-bottom: .2em; }
a { color: #1f5fa8; text-decoration: none; } a:hover { text-decoration: underline; }
table { border-collapse: collapse; font-size: 14px; margin: 1em 0; display: block; overflow-x: auto; }
th, td { border-bottom: 1px solid #e4e4e4; padding: .3em .7em; text-align: left; vertical-align: top; }
th { background: #f5f6f8; } img { max-width: 100%; height: auto; }
code { background: #f5f6f8; padding: 0 .2em; font-size: 90%; }
pre { background: #f5f6f8; padding: .8em 1em; overflow-x: auto; line-height: 1.35; font-size: 95%; }
pre code { padding: 0; }
"""
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title} - raychan</title><style>{style}</style></head>
<body><nav>{menu}</nav><main>
{body}</main></body></html>
"""


def title_of(page: Path) -> str:
    """Return the first heading of a page."""
    return page.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")


def target(name: str) -> Path:
    """Return where a page goes within the built folder."""
    return Path(name.removeprefix("../")).with_suffix(".html")


def menu(here: str) -> str:
    """Return the links to all pages, as seen from one of them."""
    up = "../" * (len(target(here).parts) - 1)
    lines = []
    for head, names in MENU:
        lines.append(f"<b>{head}</b>")
        for name in names:
            mark = ' class="here"' if name == here else ""
            lines.append(f'<a{mark} href="{up}{target(name).as_posix()}">{title_of(HERE / name)}</a>')
    return "\n".join([*lines, "<b>API reference</b>", f'<a href="{up}api/raychan.html">raychan</a>'])


def anchored(body: str) -> str:
    """Return HTML whose headings can be linked to, by the names that GitHub gives them."""

    def heading(match: re.Match[str]) -> str:
        plain = re.sub(r"<[^>]+>", "", match[2])
        name = re.sub(r"[^\w -]", "", plain.lower()).replace(" ", "-")
        return f'<{match[1]} id="{name}">{match[2]}</{match[1]}>'

    return re.sub(r"<(h[23])>(.*?)</\1>", heading, body)


def relinked(body: str, page: Path, name: str, out: Path) -> str:
    """Return HTML whose links lead to built pages; what else they lead to is copied along."""
    known = {(HERE / n).resolve(): target(n) for _, names in MENU for n in names}
    up = "../" * (len(target(name).parts) - 1)

    def link(match: re.Match[str]) -> str:
        address, _, anchor = match[2].partition("#")
        if re.match(r"\w+:", address) or not address:
            return match[0]
        file = (page.parent / address).resolve()
        if file in known:
            place = known[file]
        elif file.is_file():
            place = Path("files") / file.relative_to(ROOT)
            (out / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, out / place)
        else:
            raise SystemExit(f"{page}: link to {address}, which is not there")
        return f'{match[1]}="{up}{place.as_posix()}{"#" + anchor if anchor else ""}"'

    return re.sub(r'(href|src)="([^"]+)"', link, body)


def coloured(code: str, language: str, attributes: str) -> str:
    """Return a code block as HTML; markdown-it calls this."""
    from pygments import highlight
    from pygments.formatters import HtmlFormatter
    from pygments.lexers import get_lexer_by_name

    return str(highlight(code, get_lexer_by_name(language or "text"), HtmlFormatter(nowrap=True)))


def pages(out: Path) -> None:
    """Write all pages of the menu."""
    listed = {(HERE / n).resolve() for _, names in MENU for n in names}
    if missing := {p.resolve() for p in HERE.rglob("*.md")} - listed:
        raise SystemExit(f"pages in no menu: {sorted(map(str, missing))}")
    from pygments.formatters import HtmlFormatter

    render = MarkdownIt("commonmark", {"html": False, "highlight": coloured}).enable("table").render
    style = (
        STYLE + str(HtmlFormatter(style="friendly").get_style_defs("pre")) + "pre, pre code { background: #f5f6f8; }"
    )
    for _, names in MENU:
        for name in names:
            page = HERE / name
            body = relinked(anchored(render(page.read_text(encoding="utf-8"))), page, name, out)
            place = out / target(name)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(
                PAGE.format(title=title_of(page), style=style, menu=menu(name), body=body), encoding="utf-8"
            )


def loaded(name: str) -> ModuleType:
    """Return a module with its public names, which raychan loads when first used."""
    module = importlib.import_module(name)
    for public in getattr(module, "__all__", ()):
        vars(module)[public] = getattr(module, public)
    return module


def column(variable: Any) -> str:
    """Return axes, dtype, unit and meaning of a record's column, which pdoc does not know; empty for all else."""
    class_name, _, name = variable.qualname.rpartition(".")
    owner = getattr(sys.modules.get(variable.modulename), class_name, None)
    for field in dataclasses.fields(owner) if dataclasses.is_dataclass(owner) else ():
        if field.name == name and "axes" in field.metadata:
            m = field.metadata
            unit = f" [{m['unit']}]" if m["unit"] != "1" else ""
            return f"({', '.join(m['axes'])}) {m['dtype']}{unit}{': ' if m['doc'] else ''}{m['doc']}"
    return ""


def reference(out: Path) -> None:
    """Write the API reference."""
    import pdoc

    for name in MODULES:
        loaded(name)
    pdoc.render.configure(show_source=False, template_directory=HERE / "api_template")
    pdoc.render.env.filters["column"] = column
    pdoc.pdoc(*MODULES, output_directory=out / "api")


def main() -> None:
    """Build everything into the folder that the command line names."""
    out = Path(sys.argv[1])
    warnings.simplefilter("error")
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    pages(out)
    reference(out)
    print(f"documentation: {out / 'index.html'}")


if __name__ == "__main__":
    main()
