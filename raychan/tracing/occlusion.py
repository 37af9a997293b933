"""How much of a body's silhouette, seen from a point, other bodies block, and which ones (by sampling with rays)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR, Facets, Points
from raychan.world.ray_caster import RayCaster

Floats = NDArray[np.float64]

_WIDEST = np.cos(np.radians(75.0))  # silhouettes wider than this about their middle are sampled over the whole sphere
_SLACK = 1e-4  # m: a body that touches the target's surface does not block it


@dataclass(frozen=True)
class Occlusion:
    """What hides a body; shares are of the solid angle of its silhouette."""

    solid_angle: float
    """Of the whole silhouette, as if nothing were in the way [sr]; 0 for a body seen edge on."""
    blocked: float | None
    """Share behind something opaque; None for a body without a silhouette."""
    behind_layers: float | None
    """Share seen through thin layers (glass, bumper) alone."""
    error: float
    """Of the shares, by sampling: twice the standard deviation, and no less than one sample."""
    by: tuple[tuple[str, float], ...]
    """Bodies and the shares that they block, largest first; the first opaque one on the way counts."""
    point: str | None
    """Body or 'body.part' that hides the point of a target given by its RCS; '' if in sight, None without a point."""


def occlusion(facets: Facets, points: Points, eye: Floats, body: str, layers: int = 4, rays: int = 40_000) -> Occlusion:
    """Return how much of a body is hidden from a point, by two rays in each cell of a grid over its silhouette.

    Args: facets, points of the scene; eye (3,) [m]; body its name; layers: how many thin ones a ray may pass;
    rays over the rectangle about the silhouette. The rays' positions in their cells are the same in every run.
    Raises: ValueError for an unknown body, or one without a silhouette such as the ground.
    """
    if body not in facets.body_names:
        raise ValueError(f"no body '{body}'; there are {', '.join(facets.body_names)}")
    index = facets.body_names.index(body)
    if facets.role[index] == MIRROR:
        raise ValueError(f"'{body}' is a mirror without an outline")
    eye = np.asarray(eye, float)
    scene = RayCaster(facets)
    own = np.flatnonzero(facets.body == index)
    directions, weight = _ray_directions(facets.vertices[own].reshape(-1, 3) - eye, max(rays // 2, 1))
    starts, none = np.broadcast_to(eye, directions.shape), np.full(len(directions), -1, np.int32)
    hit, distance = _caster_of(facets, own).cast(starts, directions, none)
    seen = np.flatnonzero(hit >= 0)
    reached, passed, blocker = scene.walk(
        np.broadcast_to(eye, (len(seen), 3)), directions[seen], distance[seen], np.full(len(seen), _SLACK),
        np.full(len(seen), -1, np.int32), own[hit[seen]].astype(np.int32), layers, np.full(len(seen), index),
    )  # fmt: skip
    hides, behind = blocker >= 0, reached & (passed >= 0).any(axis=1)
    outline = weight[seen]
    whole = float(outline.sum())
    point = _point(scene, points, eye, index, layers)
    if whole == 0.0:
        return Occlusion(0.0, None, None, 0.0, (), point)
    blocked = float(outline[hides].sum()) / whole
    shares = np.bincount(facets.body[blocker[hides]], outline[hides], len(facets.body_names)) / whole
    residual = np.zeros(len(directions))
    residual[seen] = np.where(hides, outline, 0.0) - blocked * outline
    return Occlusion(
        solid_angle=whole,
        blocked=blocked,
        behind_layers=float(outline[behind].sum()) / whole,
        error=_error(residual, whole, len(seen)),
        by=tuple((facets.body_names[b], float(shares[b])) for b in np.argsort(-shares, kind="stable") if shares[b] > 0),
        point=point,
    )


def _ray_directions(corners: Floats, cells: int) -> tuple[Floats, Floats]:
    """Return unit directions (2n, 3), two after another in a cell, and the solid angle [sr] each stands for.

    Args: corners (k, 3) [m] of the body from the eye; cells about how many. In a plane before the eye the silhouette
    of a body lies within the rectangle about its corners; where the body is too wide for that, the whole sphere is
    sampled.
    """
    towards = corners / np.maximum(np.linalg.norm(corners, axis=1, keepdims=True), 1e-12)
    middle = 0.5 * (towards.min(axis=0) + towards.max(axis=0))
    ahead = middle / max(float(np.linalg.norm(middle)), 1e-12)
    flat = bool((towards @ ahead > _WIDEST).all())
    if not flat:
        ahead = np.array([1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0]) if abs(ahead[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    left = np.cross(up, ahead)
    left /= np.linalg.norm(left)
    axes = np.array([ahead, left, np.cross(ahead, left)])
    if flat:
        local = towards @ axes.T
        on_plane = local[:, 1:] / local[:, :1]
        low, high = on_plane.min(axis=0), on_plane.max(axis=0)
    else:
        low, high = np.array([-np.pi, -1.0]), np.array([np.pi, 1.0])
    size = np.maximum(high - low, 1e-9)
    across = max(1, round(float(np.sqrt(cells * size[0] / size[1]))))
    count = np.array([min(across, cells), max(1, cells // across)])
    # Random positions in the cells, the same in every run: a regular grid would beat with regular edges.
    place = np.random.default_rng(0).random((int(count.prod()), 2, 2))
    cell = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 1, 2)
    u, v = (low + (cell + place) / count * size).reshape(-1, 2).T
    area = float(size.prod()) / len(u)
    if flat:
        out = np.column_stack([np.ones(len(u)), u, v])
        reach = np.linalg.norm(out, axis=1)
        return out / reach[:, None] @ axes, area / reach**3
    ring = np.sqrt(1.0 - v**2)
    return np.column_stack([ring * np.cos(u), ring * np.sin(u), v]), np.full(len(u), area)


def _caster_of(facets: Facets, rows: NDArray[np.int64]) -> RayCaster:
    """Return a ray caster of some facets alone."""
    return RayCaster(
        facets.replace(**{k: getattr(facets, k)[rows] for k in ("vertices", "normals", "body", "part", "material")})
    )


def _error(residual: Floats, whole: float, count: int) -> float:
    """Return twice the standard deviation of a ratio of sums over cells of two samples each, from their differences.

    Args: residual (2n,) of part less ratio times whole, samples of a cell beside each other. Source: Cochran,
    Sampling Techniques, 1977, 5.10 and 6.3.
    """
    pairs = residual.reshape(-1, 2)
    deviation = float(np.sqrt(((pairs[:, 0] - pairs[:, 1]) ** 2).sum())) / whole
    return max(2.0 * deviation, 1.0 / count)


def _point(scene: RayCaster, points: Points, eye: Floats, body: int, layers: int) -> str | None:
    """Return what blocks the point of a target given by its RCS: see `Occlusion.point`."""
    mine = np.flatnonzero(points.body == body)
    if not len(mine):
        return None
    towards = points.position[mine[:1]] - eye
    far = np.linalg.norm(towards, axis=1)
    none = np.full(1, -1, np.int32)
    reached, _, blocker = scene.walk(
        eye[None], towards / far[:, None], far, np.full(1, _SLACK), none, none, layers, np.full(1, body)
    )
    if reached[0]:
        return ""
    f = scene.facets
    part = f.part_names[f.part[blocker[0]]]
    name = f.body_names[f.body[blocker[0]]]
    return f"{name}.{part}" if part else name
