"""The text, HTML and plots of records, scenes and results in console and notebook.

`facts()` of an object gives a title, lines of (what, text), and perhaps a table, of which the first rows are shown.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from raychan.units import db, dbm

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

_ROWS = 12


@dataclass(frozen=True)
class Facts:
    """What console and notebook show of an object."""

    title: str
    lines: tuple[tuple[str, str], ...] = ()
    heads: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()

    def text(self) -> str:
        """Return the facts as plain text."""
        wide = max((len(what) for what, _ in self.lines), default=0)
        out = [self.title, *(f"  {what:<{wide}}  {text}" for what, text in self.lines)]
        shown = [self.heads, *self.rows[:_ROWS]] if self.heads else []
        widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
        out += ["  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in shown]
        return "\n".join([*out, *(f"  {line}" for line in self._rest())])

    def html(self) -> str:
        """Return the facts as a piece of HTML."""
        lines = "".join(f"<tr><th>{escape(what)}</th><td>{escape(text)}</td></tr>" for what, text in self.lines)
        made = f"<div><b>{escape(self.title)}</b><table>{lines}</table>"
        if self.heads:
            rows = "".join(_row("td", row) for row in self.rows[:_ROWS])
            made += f"<table><thead>{_row('th', self.heads)}</thead><tbody>{rows}</tbody></table>"
        return made + "".join(f"<div>{escape(line)}</div>" for line in self._rest()) + "</div>"

    def _rest(self) -> list[str]:
        more = len(self.rows) - _ROWS
        return [f"and {more} more"] if more > 0 else []


class Described:
    """Base of objects whose repr and HTML repr show their facts."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.__repr__ = Described.__repr__  # type: ignore[method-assign]  # else dataclass makes one of whole arrays

    def facts(self) -> Facts:
        """Return what is shown: of a record its columns, their sizes and spans."""
        known = (_OWN[kind.__name__] for kind in type(self).__mro__ if kind.__name__ in _OWN)
        return next(known, _columns)(self)

    def __repr__(self) -> str:
        return self.facts().text()

    def _repr_html_(self) -> str:
        return self.facts().html()


class Plotted:
    """Base of what has one plot."""

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw with matplotlib and return the axes, those given or those of a new figure of pyplot."""
        from raychan.report.shown import draw

        return draw(self, axes)  # type: ignore[no-any-return]


class PlottedTwice:
    """Base of what has two plots, side by side."""

    def plot(self, axes: Sequence[Axes] | None = None) -> tuple[Axes, Axes]:
        """Draw with matplotlib and return both axes, those given or those of a new figure of pyplot."""
        from raychan.report.shown import draw

        first, second = draw(self, axes)
        return first, second


def span(values: Any, unit: str = "", digits: int = 4) -> str:
    """Return 'least to most unit' of an array, NaN and infinity left out."""
    real = np.asarray(values, float).ravel()
    real = real[np.isfinite(real)]
    if not real.size:
        return "none"
    least, most = (f"{x:.{digits}g}" for x in (real.min(), real.max()))
    return (least if least == most else f"{least} to {most}") + (f" {unit}" if unit else "")


def counted(count: int, what: str) -> str:
    """Return '1 path', '2 paths'."""
    return f"{count:,} {what}{'' if count == 1 else 's'}"


def _row(cell: str, texts: tuple[str, ...]) -> str:
    return "<tr>" + "".join(f"<{cell}>{escape(text)}</{cell}>" for text in texts) + "</tr>"


def _columns(record: Any) -> Facts:
    lines = []
    for f in dataclasses.fields(record):
        value = getattr(record, f.name)
        if "axes" in f.metadata:
            axes = " x ".join(
                f"{size}" if a.isdigit() else f"{a}={size}"
                for a, size in zip(f.metadata["axes"], value.shape, strict=True)
            )
            unit = "" if f.metadata["unit"] == "1" else f.metadata["unit"]
            what = f"|{f.name}| " if np.iscomplexobj(value) else ""
            lines.append((f.name, f"({axes})  {what}{span(np.abs(value) if what else value, unit)}"))
        elif isinstance(value, Described):
            lines.append((f.name, type(value).__name__))
        elif isinstance(value, tuple):
            lines.append((f.name, f"{len(value)}: {', '.join(map(str, value[:8]))}{', ...' if len(value) > 8 else ''}"))
        else:
            lines.append((f.name, f"{value:.6g}" if isinstance(value, float) else str(value)))
    return Facts(type(record).__name__, tuple(lines))


def _paths(p: Any) -> Facts:
    bodies = np.unique(p.trajectories.body[p.trajectories.body >= 0])
    met = [p.body_names[b] for b in bodies]
    # Of all polarisations the strongest: what rounding leaves of the others is 300 dB below.
    gain = np.abs(p.amplitude) if hasattr(p, "amplitude") else np.abs(p.gain).reshape(len(p.gain), 4).max(axis=1)
    gain = gain[gain > 0.0]
    depth = (p.trajectories.kind > 0).sum(axis=1)
    lines = [
        ("range", span(p.range, "m")),
        ("range rate", span(p.range_rate, "m/s")),
        ("gain", span(db(gain**2), "dB")),
        ("interactions", span(depth)),
        ("over", ", ".join(met[:8]) + (f" and {len(met) - 8} more" if len(met) > 8 else "") or "nothing"),
    ]
    return Facts(f"{type(p).__name__}: {counted(len(p.delay), 'path')}", tuple(lines))


def _map(m: Any) -> Facts:
    peak = np.unravel_index(np.argmax(m.power), m.power.shape)
    lines = [
        ("range", f"{span(m.range, 'm')}, resolution {m.range_resolution:.3g} m"),
        ("range rate", f"{span(m.rate, 'm/s')}, resolution {m.rate_resolution:.3g} m/s"),
        ("peak", f"{dbm(m.power[peak]):.1f} dBm at {m.range[peak[1]]:.2f} m, {m.rate[peak[0]]:+.2f} m/s"),
        ("noise", f"{dbm(m.noise):.1f} dBm a cell" if m.noise > 0.0 else "unknown"),
    ]
    rates, ranges = m.power.shape
    return Facts(f"RangeDoppler: {rates} rates x {ranges} ranges, {counted(len(m.spectrum), 'antenna')}", tuple(lines))


def detection_rows(d: Any) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return heads and rows of a table of detections; angles only where an array gives them."""
    columns = [
        ("range m", [f"{x:.2f}" for x in d.range]),
        ("range rate m/s", [f"{x:+.2f}" for x in d.rate]),
        ("speed m/s", [f"{x:+.2f}" for x in d.speed]),
        ("SNR dB", [f"{x:.1f}" for x in d.snr]),
        ("power dBm", [f"{dbm(x):.1f}" for x in d.power]),
    ]
    for name in ("elevation", "azimuth"):
        angle = np.degrees(getattr(d, name))
        if np.isfinite(angle).any():
            columns.insert(3, (f"{name} deg", [f"{x:.1f}" if np.isfinite(x) else "" for x in angle]))
    return tuple(head for head, _ in columns), list(zip(*(cells for _, cells in columns), strict=True))


def _detections(d: Any) -> Facts:
    heads, rows = detection_rows(d)
    if rows and hasattr(d, "converged"):
        told = [f"{e:.2f}" if known else "unknown" for e, known in zip(d.error_db, d.converged, strict=True)]
        folded = [f"{r:.2f}" if f else "" for r, f in zip(d.true_range, d.folded, strict=True)]
        numbers = (str(i + 1) for i in range(len(rows)))
        rows = [(n, *row, e, f) for n, row, e, f in zip(numbers, rows, told, folded, strict=True)]
        heads = ("#", *heads, "error dB", "folded: true m")
    return Facts(f"{type(d).__name__}: {len(rows)}", (), heads if rows else (), tuple(rows))


def _scene(scene: Any) -> Facts:
    radar = scene.radar_table
    lines = [] if radar is None else [
        (
            "radar",
            f"at {_place(radar.position)} m, {scene.frequency / 1e9:g} GHz, {radar.waveform.bandwidth_mhz:g} MHz",
        ),
    ]  # fmt: skip
    rows = []
    for body in scene.bodies:
        what = body.shape or (Path(body.mesh).name if isinstance(body.mesh, str | Path) else "mesh")
        moves = f"{_place(body.velocity)} m/s" if any(body.velocity) else "at rest"
        rows.append((body.name, what, counted(len(body.geometry.faces), "facet"), f"{_place(body.position)} m", moves))
    title = f"Scene: {scene.title}" if scene.title else "Scene"
    lines.append(("bodies", str(len(rows))))
    return Facts(title, tuple(lines), ("body", "is", "of", "at", "moves") if rows else (), tuple(rows))


def _result(r: Any) -> Facts:
    heads, rows = detection_rows(r.detections)
    why = [(f"{e.error_db:.2f}" if e.converged else "unknown", e.label, e.bodies) for e in r.provenance]
    name = r.scene.title if r.scene is not None else r.path
    lines = [("paths", f"{len(r.paths.delay):,}"), ("seed", str(r.seed)), *(("warning", text) for text in r.warnings)]
    lines.append(("detections", str(len(rows))))
    rows = [(*row, *told) for row, told in zip(rows, why, strict=True)]
    heads = (*heads, "error dB", "label", "bodies") if rows else ()
    return Facts(f"Result: {name}" if name else "Result", tuple(lines), heads, tuple(rows))


def _place(at: Any) -> str:
    return "(" + ", ".join(f"{x:g}" for x in at) + ")"


_OWN = {"PropagationPaths": _paths, "RangeDoppler": _map, "Detections": _detections, "Scene": _scene, "Result": _result}
"""Classes with facts of their own, by name; other records show their columns."""
