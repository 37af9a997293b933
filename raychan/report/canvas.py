"""Figures by matplotlib, which is imported here only: one style, drawn without a display, and placement of labels."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.run.files.output import write_picture

Floats = NDArray[np.float64]

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.facecolor": "white",
}

MARKS = {
    "direct": ("o", "#ffffff"),
    "multipath": ("^", "#ffd54a"),
    "clutter": ("X", "#ff8a80"),
    "sidelobe": ("v", "#80d8ff"),
    "dc": ("D", "#b9f6ca"),
    "image": ("P", "#ea80fc"),
    "interference": ("*", "#ffab40"),
}
"""Marker and colour of a detection by its label, chosen to stand out on the map."""

PALETTE = (
    "#4477aa", "#44bb99", "#ee8866", "#66ccee", "#aa3377", "#228833", "#ccbb44", "#cc6677", "#882255", "#999933",
)  # fmt: skip
"""Paul Tol's bright and muted colours, which colour-blind readers can distinguish too."""


def figure(width: float, height: float, layout: Any = "constrained") -> Any:
    """Return an empty matplotlib Figure, sizes in inches, that needs no display."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        made = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(made)
    return made


def show_figure(width: float, height: float, layout: Any = "constrained") -> Any:
    """Return an empty figure of pyplot, which a notebook or `pyplot.show()` shows; sizes in inches."""
    import matplotlib.pyplot as plt

    with style():
        made = plt.figure(figsize=(width, height), layout=layout)
    if hasattr(made.canvas, "get_renderer"):
        return made
    plt.close(made)  # a backend that cannot measure text
    return figure(width, height, layout)


def on(axes: Any, width: float, height: float) -> tuple[Any, Any]:
    """Return the figure of axes and the axes; without axes, a new figure of that size and its own."""
    if axes is None:
        axes = figure(width, height).add_subplot()
    return axes.figure, axes


def collections() -> Any:
    """Return matplotlib's module of collections in 3-D."""
    from mpl_toolkits.mplot3d import art3d

    return art3d


def style() -> Any:
    """Return the context in which axes take the style."""
    import matplotlib

    return matplotlib.rc_context(STYLE)


def save(made: Any, path: str | Path, flat: bool = False) -> Path:
    """Write a figure at 200 dots an inch and return its path; a `flat` PNG, of lines and marks, with 256 colours."""
    return write_picture(path, drawn_as(made, Path(path).suffix, flat))


def drawn_as(made: Any, suffix: str, flat: bool = False) -> memoryview:
    """Return a figure as the bytes of a file of a suffix such as '.png'; see `save`."""
    drawn = io.BytesIO()
    made.savefig(drawn, dpi=200, format=suffix[1:].lower() or "png")
    if flat:  # a third of the size
        from PIL import Image

        with Image.open(drawn) as picture:
            few = picture.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        drawn = io.BytesIO()
        few.save(drawn, "PNG", optimize=True)
    return drawn.getbuffer()


FONT = "DejaVu Sans"
"""Comes with matplotlib; of Latin, Greek, Cyrillic, Arabic and other letters."""


@cache
def font_file(family: str = FONT) -> str | None:
    """Return the file of a family of fonts, or None where it is not installed."""
    from matplotlib.font_manager import FontProperties, findfont

    try:
        return str(findfont(FontProperties(family=[family]), fallback_to_default=False))
    except ValueError:
        return None


@cache
def _letters(family: str) -> frozenset[int]:
    from matplotlib.font_manager import get_font

    file = font_file(family)
    return frozenset() if file is None else frozenset(get_font(file).get_charmap())


def legible(text: str, families: Iterable[str] = (FONT,)) -> str:
    r"""Return a text in which each character that no font of `families` draws is written out, as \u65e5."""
    drawn = frozenset({ord("\n")}).union(*map(_letters, families))
    return "".join(c if ord(c) in drawn else c.encode("unicode_escape").decode() for c in text)


def verbatim(text: str) -> str:
    """Return a name or title so that matplotlib draws it as it stands, without warnings of what its font lacks:
    no part of it is mathematics."""
    import matplotlib

    return legible(text, matplotlib.rcParams["font.family"]).replace("$", r"\$")


def outlined(width: float = 2.0, colour: str = "black") -> list[Any]:
    """Return path effects that put an outline round text or lines, so that they are legible on any background."""
    from matplotlib import patheffects

    return [patheffects.withStroke(linewidth=width, foreground=colour)]


_ALONG = np.linspace(0.0, 1.0, 80)


class Placer:
    """Places labels beside points so that they overlap neither each other nor what is already drawn."""

    def __init__(self, axes: Any) -> None:
        self.axes = axes
        self.taken = np.zeros((0, 4))  # boxes in pixels: left, bottom, right, top

    def prepare(self) -> None:
        """Lay the figure out, so that pixel positions are final; call when all else is drawn."""
        self.axes.figure.draw_without_rendering()

    def avoid(self, x: Floats, y: Floats, size: float) -> None:
        """Keep labels and their lines away from marks of `size` points at data (x, y), each (n,)."""
        at = self.axes.transData.transform(np.column_stack([x, y]))
        half = 0.5 * size * self.axes.figure.dpi / 72.0
        self.taken = np.concatenate([self.taken, np.hstack([at - half, at + half])])

    def spare(self, artist: Any) -> None:
        """Keep labels and their lines away from an artist, such as a legend."""
        box = artist.get_window_extent(self.axes.figure.canvas.get_renderer()).extents
        self.taken = np.concatenate([self.taken, np.asarray(box, float)[None]])

    def label(self, x: float, y: float, text: str, above: bool = False, **style: Any) -> bool:
        """Write `text` at the nearest free place around (or above) data (x, y), with a line to it; False if none is
        free."""
        from matplotlib.text import Text

        line = {"arrowstyle": "-", "lw": 0.6, "shrinkA": 0, "shrinkB": 3, "color": style.get("color", "black")}
        note = self.axes.annotate(
            verbatim(text),
            (x, y),
            xytext=(0, 0),
            textcoords="offset points",
            ha="center",
            va="center",
            arrowprops=line,
            **style,
        )
        renderer = self.axes.figure.canvas.get_renderer()
        inside = self.axes.get_window_extent(renderer).extents
        per_point = self.axes.figure.dpi / 72.0
        size = note.get_window_extent(renderer)
        point = self.axes.transData.transform((x, y))
        places = _places(0.5 * size.width / per_point, 0.5 * size.height / per_point, above)
        for own in (8.0 * per_point, np.inf):  # second try: the label's line may cross what is drawn
            for place in places:
                note.set_position(place)
                note.update_positions(renderer)
                box = np.array(Text.get_window_extent(note, renderer).padded(2.0).extents)
                within = (box[:2] >= inside[:2]).all() and (box[2:] <= inside[2:]).all()
                if within and self._free(point, box, own):
                    self.taken = np.concatenate([self.taken, box[None]])
                    return True
        note.remove()
        return False

    def _free(self, point: Floats, box: Floats, own: float) -> bool:
        """Return whether a box, and the line to it beyond `own` pixels from its point, are free."""
        low, high = self.taken[:, :2], self.taken[:, 2:]
        if ((low < box[2:]) & (high > box[:2])).all(axis=1).any():
            return False
        way = point + _ALONG[:, None] * (0.5 * (box[:2] + box[2:]) - point)
        way = way[np.linalg.norm(way - point, axis=1) > own, None]
        return not ((low < way) & (way < high)).all(axis=2).any()


def _places(wide: float, high: float, above: bool) -> list[tuple[float, float]]:
    """Return offsets of a label's centre in points, the nearest first."""
    found = []
    for ring in range(12):
        gap = 6.0 + 9.0 * ring
        for step in (0, 1, -1, 2, -2, 3, -3) if above else range(16):
            angle = math.pi * (0.5 + step / 8.0)
            found.append((math.cos(angle) * (gap + wide), math.sin(angle) * (gap + high)))
    return found
