"""The drawing of a scene and its rays as plain arrays, for all renderers."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import LAYER, MIRROR, Facets, Paths, Points
from raychan.report.canvas import PALETTE
from raychan.units import dbm, undb

if TYPE_CHECKING:  # what draws in a process of its own reads a drawing and needs no run
    from raychan.run.explain import CellExplanation
    from raychan.run.result import Explanation, Result

Floats = NDArray[np.float64]

_NAMED = {
    "red": "#c0392b", "blue": "#2e6da4", "green": "#2e8b57", "yellow": "#d9b310", "white": "#e8e8e8",
    "black": "#3a3a3a", "grey": "#8a8a8a", "gray": "#8a8a8a", "silver": "#b8bcc0", "orange": "#e07b39",
    "brown": "#7b5a3c",
}  # fmt: skip
"""A body with a colour in its name is drawn in that colour."""

GLASS, GROUND = "#9fc5d8", "#b9b6ae"
_RAYS = 30  # most rays that are drawn
_LINES = 8  # chains that a caption lists
_FAINT = 0.25  # opacity of bodies that no path of a cell meets
_WEAKEST_DB = 45.0  # rays weaker than the strongest by more than this are not drawn


@dataclass(frozen=True)
class Shape:
    """Triangles (n, 3, 3) [m] of one colour."""

    name: str
    triangles: Floats
    colour: str
    opacity: float = 1.0


@dataclass(frozen=True)
class Ray:
    """A ray through the scene: points (k, 3) [m] from radar to radar, and its received power [dBm]."""

    name: str
    points: Floats
    power: float
    label: str
    converged: bool = True
    """Whether the detection that it contributes to is converged."""

    @property
    def text(self) -> str:
        """The ray's bodies, power and label as a line."""
        return f"{self.name}: {self.power:.1f} dBm {self.label}{'' if self.converged else ', not converged'}"

    def strokes(self, dash: float) -> list[Floats]:
        """Return the lines to draw, (k, 3) [m] each: the whole ray, or dashes [m] of it where it is not converged."""
        if self.converged:
            return [self.points]
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))])
        # Symmetric about the middle, so that the return leg does not fill the gaps of the outgoing one.
        middle, made = 0.5 * along[-1], []
        count = int(middle // (2.0 * dash)) + 1
        for start in middle + 2.0 * dash * np.arange(-count, count + 1) - 0.5 * dash:
            inner = along[(along > start) & (along < start + dash)]
            at = np.unique(np.clip([start, *inner, start + dash], 0.0, along[-1]))
            made.append(np.stack([np.interp(at, along, x) for x in self.points.T], axis=1))
        return [m for m in made if len(m) > 1]


@dataclass(frozen=True)
class Drawing:
    """Shapes and rays, and where the radar stands and looks."""

    title: str
    shapes: tuple[Shape, ...]
    rays: tuple[Ray, ...]
    radar: Floats
    boresight: Floats
    targets: tuple[tuple[str, tuple[float, float, float]], ...]
    """Names and places to write them."""
    caption: str = ""
    """The chains of bodies of a cell, where only its rays are shown."""
    observer: str = "radar"
    """What stands at `radar`."""

    @property
    def note(self) -> str:
        """What dashed rays mean, where there are any."""
        return "" if all(ray.converged for ray in self.rays) else "dashed: of detections that are not converged"

    def bounds(self) -> tuple[Floats, Floats]:
        """Return the lowest and highest corner of all but the ground."""
        solid = [s.triangles.reshape(-1, 3) for s in self.shapes if s.name != "ground"]
        every = np.concatenate([*solid, *(r.points for r in self.rays), self.radar[None]])
        return every.min(axis=0), every.max(axis=0)

    def floor(self) -> tuple[Floats, Floats]:
        """Return the lowest and highest corner of the ground, or where there is none of a level under the scene."""
        for shape in self.shapes:
            if shape.name == "ground":
                corners = shape.triangles.reshape(-1, 3)
                return corners.min(axis=0), corners.max(axis=0)
        low, high = self.bounds()
        room = max(2.0, 0.05 * float((high - low)[:2].max())) * np.array([1.0, 1.0, 0.0])
        return low - room, np.array([*high[:2], low[2]]) + room

    def specks(self, size: float) -> list[tuple[tuple[float, float, float], str]]:
        """Return place and colour of the named bodies whose largest side is below a size [m], points among them."""
        found = []
        for name, place in self.targets:
            own = [s for s in self.shapes if s.name == name]
            corners = np.concatenate([np.array([place]), *(s.triangles.reshape(-1, 3) for s in own)])
            if np.ptp(corners, axis=0).max() < size:
                found.append((place, own[0].colour if own else _NAMED["black"]))
        return found

    def save(self, path: str | Path) -> None:
        """Write the drawing to an .npz file, for another process to render."""
        arrays = {f"t{i}": s.triangles for i, s in enumerate(self.shapes)}
        arrays |= {f"r{i}": r.points for i, r in enumerate(self.rays)}
        about = asdict(self)
        for item in (*about["shapes"], *about["rays"]):
            item.pop("triangles", None)
            item.pop("points", None)
        about["radar"], about["boresight"] = self.radar.tolist(), self.boresight.tolist()
        np.savez(path, about=np.array(json.dumps(about)), **arrays)  # type: ignore[arg-type]

    @staticmethod
    def load(path: str | Path) -> Drawing:
        """Return a drawing from an .npz file."""
        with np.load(path) as held:
            about: dict[str, Any] = json.loads(str(held["about"]))
            shapes = tuple(Shape(triangles=held[f"t{i}"], **s) for i, s in enumerate(about["shapes"]))
            rays = tuple(Ray(points=held[f"r{i}"], **r) for i, r in enumerate(about["rays"]))
        targets = tuple((name, (x, y, z)) for name, (x, y, z) in about["targets"])
        radar, boresight = np.array(about["radar"]), np.array(about["boresight"])
        return Drawing(about["title"], shapes, rays, radar, boresight, targets, about["caption"], about["observer"])


def draw(
    title: str,
    facets: Facets,
    points: Points,
    radar: Floats,
    boresight: Floats,
    result: Result | None,
    cell: CellExplanation | None = None,
) -> Drawing:
    """Return the drawing of a scene at one instant; with a result, also the rays of its detections.

    Args: cell, the map cell whose rays alone are drawn; bodies that they do not meet are transparent.
    """
    rays: tuple[Ray, ...] = ()
    if result is not None:
        rays = rays_of(result) if cell is None else rays_in(result, cell)
    met = None if cell is None else {_body(link) for part in cell.contributions for link in part.chain}
    shapes: list[Shape] = []
    targets: list[tuple[str, tuple[float, float, float]]] = []
    glass = (facets.materials.kind == LAYER)[facets.material] if len(facets.material) else np.zeros(0, bool)
    colours = iter(PALETTE * (1 + len(facets.body_names) // len(PALETTE)))
    for b, name in enumerate(facets.body_names):
        if facets.role[b] == MIRROR:
            continue
        mine = facets.body == b
        colour = next((shade for word, shade in _NAMED.items() if word in name.lower().split("_")), None) or next(
            colours
        )
        if not mine.any():
            continue
        thin = 1.0 if met is None or name in met else _FAINT
        for rows, tint, opacity in ((mine & ~glass, colour, thin), (mine & glass, GLASS, 0.4 * thin)):
            if rows.any():
                shapes.append(Shape(name, facets.vertices[rows], tint, opacity))
        corners = facets.vertices[mine].reshape(-1, 3)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        targets.append((name, (float(middle[0]), float(middle[1]), float(corners[:, 2].max()))))
    named = {name for name, _ in targets}
    for i in range(len(points.position)):
        name = facets.body_names[points.body[i]] if points.body[i] >= 0 else f"point {i}"
        if name not in named:
            x, y, z = points.position[i].tolist()
            targets.append((name, (x, y, z)))
    mirrors = facets.role[facets.body] == MIRROR if len(facets.body) else np.zeros(0, bool)
    caption = "" if cell is None else _listed([part.text() for part in cell.contributions])
    eye, ahead = np.asarray(radar, float), np.asarray(boresight, float)
    made = Drawing(title, tuple(shapes), rays, eye, ahead, tuple(targets), caption)
    if mirrors.any():
        made = _with_ground(made, float(np.median(facets.vertices[mirrors][..., 2])))
    return made


def rays_of(result: Result, most: int = _RAYS) -> tuple[Ray, ...]:
    """Return the strongest path of each chain behind a detection, weakest first; without detections, of every chain."""
    from raychan.run.explanation.labels import chains

    paths, known = result.paths, chains(result.paths, result.receiver.background)
    size = np.abs(paths.amplitude)
    index = {chain: i for i, chain in enumerate(known.names)}
    power: dict[int, float] = {}
    of: dict[int, Explanation] = {}
    for why in result.provenance:
        for part in why.contributions:
            g, watts = index.get(part.chain, -1), part.share * why.predicted
            if g >= 0 and watts > power.get(g, 0.0):
                power[g], of[g] = watts, why
    if not power and len(size):
        whole = np.bincount(known.part, size**2) * result.receiver.power
        power = {int(g): float(whole[g]) for g in np.flatnonzero(whole > 0.0)}
    rays = []
    least = max(power.values(), default=0.0) * undb(-_WEAKEST_DB)
    for g, watts in sorted(power.items(), key=lambda item: item[1])[-most:]:
        if watts < least:
            continue
        rows = np.flatnonzero(known.part == g)
        rays.append(_ray(paths, int(rows[np.argmax(size[rows])]), known.names[g], watts, of.get(g)))
    return tuple(rays)


def rays_in(result: Result, cell: CellExplanation) -> tuple[Ray, ...]:
    """Return the path of each chain that brings most to a map cell, or to the beam of a detection; weakest first."""
    told = cell.paths
    if told is None:
        raise ValueError("cell: its paths are wanted, as `explain` returns them")
    rays = []
    for part in sorted(cell.contributions, key=lambda part: part.share):
        strongest = np.argmax(told.of(part))  # rows come strongest first
        rays.append(_ray(result.paths, int(told.row[strongest]), part.chain, part.share * cell.predicted, cell))
    return tuple(rays)


def _ray(paths: Paths, row: int, chain: tuple[str, ...], watts: float, why: Explanation | None) -> Ray:
    trajectory = paths.trajectory[row]
    used = int((paths.trajectories.kind[trajectory] > 0).sum())
    points = np.concatenate(
        [paths.tx[None], paths.trajectories.vertices[trajectory, :used].astype(float), paths.rx[None]]
    )
    label, converged = ("", True) if why is None else (why.label, why.converged)
    return Ray(" > ".join(chain) or "line of sight", points, float(dbm(watts)), label, converged)


def _listed(lines: list[str]) -> str:
    more = [f"and {len(lines) - _LINES} weaker"] if len(lines) > _LINES else []
    return "\n".join(lines[:_LINES] + more)


def _body(link: str) -> str:
    """Return the body of a link of a chain: 'body', 'body.part', or either in brackets for a layer passed."""
    return link.strip("()").split(".")[0]


def _with_ground(made: Drawing, height: float) -> Drawing:
    (x0, y0, _), (x1, y1, _) = made.floor()
    a, b, c, d = ([x, y, height] for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1)))
    ground = Shape("ground", np.array([[a, b, c], [a, c, d]]), GROUND)
    return replace(made, shapes=(ground, *made.shapes))
