"""Regimes of transparent surfaces: closed bodies with panes, and the same surfaces as one body or as several."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import stated_error
from raychan.em.fresnel import coefficients
from raychan.poses import rotation
from raychan.records import LAYER, PEC, Facets, Materials, Paths, Points
from raychan.run.solver import solve
from raychan.study.regimes_base import FREQUENCY, Complexes, Floats, K, Outcome, Regime, Row, rectangle, same_db
from raychan.tracing.settings import refinement

_GLASS, _THICK = 6.27 - 0.35j, 4e-3
_MATERIALS = Materials(
    kind=np.array([LAYER, PEC], np.int8),
    eps=np.array([_GLASS, 1.0]),
    thickness=np.array([_THICK, 0.0]),
    roughness=np.zeros(2),
)
_CELL = 0.15  # m: width of the Gaussian range response
_KNOWN_DB = 1.0  # boxes whose level is known less well are passed over: such a check could hardly fail
Sheet = tuple[Floats, int]
"""Corners (4, 3) [m] of a plane quadrilateral, and its row of the materials: 0 glass, 1 metal."""


@dataclass(frozen=True)
class _IsotropicRadar:
    """An isotropic radar at the origin."""

    position: Floats = field(default_factory=lambda: np.zeros(3))
    velocity: Floats = field(default_factory=lambda: np.zeros(3))

    def tx_field(self, look: Floats) -> Floats:
        """Return unit vectors (n, 3) along z for directions (n, 3)."""
        return np.broadcast_to([0.0, 0.0, 1.0], look.shape)

    rx_field = tx_field


def panes(quick: bool) -> Outcome:
    """Check glass boxes: the front returns what its pane alone returns, the back the same less the loss of passing the
    front twice."""
    rows = []
    passed = coefficients(LAYER, _GLASS, _THICK, 0.0, 1.0, K)[2] ** 2
    near, size = 9.0, 0.3
    for deep in (0.4, 1.2) if quick else (0.4, 0.8, 1.2, 2.0):
        for name, back in (("glass", 0), ("metal", 1)):
            sides = _box((deep, size, size), np.array([near + 0.5 * deep, 0.0, 0.0]), [0, back, 0, 0, 0, 0])
            whole = _paths(_facets(sides, True), 1, 0.5)
            for what, side, where, factor in (("front", 0, near, 1.0), (f"{name} back", 1, near + deep, passed)):
                alone = _at(_paths(_facets(sides[side : side + 1], True), 1, 0.5), where) * factor
                label = f"box {deep:g} m deep, {name} back: its {what}"
                seen = abs(_at(whole, where)) ** 2
                rows.append(same_db(label, seen, abs(alone) ** 2, 0.1, "closed form: slab, passed twice"))
    return Outcome(rows)


def joined_or_split(quick: bool) -> Outcome:
    """Model the same panes and metal sheets as one body and as several: levels may differ by their stated errors.

    Boxes that turn no face to the radar return next to nothing, which is not known: they are passed over."""
    rng = np.random.default_rng(11)
    rows, count = list[Row](), 4 if quick else 10
    for i in range(3 * count):
        if len(rows) == count:
            break
        at = np.array([rng.uniform(5.0, 7.0), *rng.uniform(-0.4, 0.4, 2)])
        turn = rotation(rng.uniform(-np.pi, np.pi), *rng.uniform(-0.15, 0.15, 2))
        sides = _box(rng.uniform(0.4, 1.2, 3), at, rng.choice(2, 6, p=[0.65, 0.35]), turn)
        one, several = (_paths(_facets(sides, whole), 2, 0.5) for whole in (True, False))
        coarse = _paths(_facets(sides, False), 2, 1.5, 0.13)
        ranges = np.arange(3.5, 9.0, 0.5 * _CELL)
        a, b, c = (_profile(p, ranges) for p in (one, several, coarse))
        best = int(np.argmax(np.abs(a)))
        stated = stated_error(complex(b[best]), float(abs(b[best] - c[best])))
        if stated <= _KNOWN_DB:
            name = f"box {i + 1} at {ranges[best]:.1f} m"
            rows.append(same_db(name, abs(b[best]) ** 2, abs(a[best]) ** 2, stated, "one body"))
    rows.append(_corner())
    return Outcome(rows)


def _corner() -> Row:
    """Return the check of two large mirrors at right angles: two bodies against one."""
    foot, up = np.array([8.0, 0.0, -0.5]), np.array([0.0, 0.0, 1.0])
    one, two = np.array([-0.7, 0.7, 0.0]), np.array([-0.7, -0.7, 0.0])
    sides: list[Sheet] = [(rectangle(foot, up, one)[0], 1), (rectangle(foot, two, up)[0], 1)]
    a, b = (_at(_paths(_facets(sides, whole), 2, 0.5), 8.0) for whole in (True, False))
    return same_db("two mirrors at right angles, 1 m", abs(b) ** 2, abs(a) ** 2, 0.02, "one body")


def _box(size: Floats | tuple[float, ...], at: Floats, kinds: object, turn: Floats | None = None) -> list[Sheet]:
    """Return the sides of a box, front (-x) and back first, each facing outward."""
    a, b, c = 0.5 * np.asarray(size, float)
    p = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-c, c)])
    p = (p if turn is None else p @ turn.T) + at
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return [(p[list(s)], int(k)) for s, k in zip(sides, np.asarray(kinds), strict=True)]


def _facets(sheets: list[Sheet], whole: bool) -> Facets:
    """Return the facets of sheets, as parts of one body or a body each."""
    v = np.concatenate([p[[[0, 1, 2], [0, 2, 3]]] for p, _ in sheets])
    normal = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    sheet = np.repeat(np.arange(len(sheets), dtype=np.int32), 2)
    bodies = 1 if whole else len(sheets)
    return Facets(
        vertices=v,
        normals=np.repeat(normal[:, None], 3, axis=1),
        body=0 * sheet if whole else sheet,
        part=sheet,
        material=np.repeat(np.array([k for _, k in sheets], np.int32), 2),
        role=np.zeros(bodies, np.int8),
        origin=np.zeros((bodies, 3)),
        velocity=np.zeros((bodies, 3)),
        spin=np.zeros((bodies, 3)),
        materials=_MATERIALS,
        body_names=tuple(f"body {i}" for i in range(bodies)),
        part_names=tuple(f"side {i}" for i in range(len(sheets))),
    )


def _paths(facets: Facets, bounces: int, tolerance_db: float, jitter: float = 0.0) -> Paths:
    none: NDArray[np.int32] = np.zeros(0, np.int32)
    points = Points(
        position=np.zeros((0, 3)), velocity=np.zeros((0, 3)), body=none, azimuth=np.array([-np.pi, np.pi]),
        sigma=np.zeros((0, 2)), heading=np.zeros(0),
    )  # fmt: skip
    rule = refinement(FREQUENCY, tolerance_db, layers=4, jitter=jitter)
    return solve(facets, points, _IsotropicRadar(), FREQUENCY, rule, bounces)[0]


def _at(paths: Paths, distance: float) -> complex:
    """Return the amplitude of all paths within 0.1 m of a range [m]."""
    return complex(paths.amplitude[np.abs(paths.range - distance) < 0.1].sum())


def _profile(paths: Paths, ranges: Floats) -> Complexes:
    """Return the amplitudes at ranges (n,) [m] of a receiver with a Gaussian range response."""
    away = (paths.range[None] - ranges[:, None]) / _CELL
    return np.asarray(np.exp(-(away**2)) @ paths.amplitude)


REGIMES = (
    Regime("panes", "Closed bodies with panes", panes),
    Regime("joined", "Split and joined bodies", joined_or_split),
)
