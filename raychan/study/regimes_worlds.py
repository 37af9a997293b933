"""Regimes of whole scenes and meshes: scenes turned and shifted, bodies turned with the view, tessellations, open
sheets, a radar on the plane of a facet."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import trimesh

from raychan.poses import rotation
from raychan.run.rcs import Rcs, rcs
from raychan.run.simulate import simulate
from raychan.study.regimes_base import FREQUENCY, Floats, Outcome, Regime, Row, at_most, plate_far, same_db, sheet
from raychan.study.regimes_mesh import rectangle
from raychan.world.body import Body
from raychan.world.errors import SceneError
from raychan.world.meshes.mesh import make_mesh
from raychan.world.scene import Scene
from raychan.world.shapes import build

_RADAR: dict[str, Any] = {
    "power_dbm": 40.0,
    "waveform": {"bandwidth_mhz": 600.0, "chirp_us": 40.0, "chirps": 16, "samples": 128},
}
_CORNERS: tuple[tuple[str, str, dict[str, Any], tuple[float, float], float], ...] = (
    ("dihedral", "dihedral", {"size": 0.2, "height": 0.3}, (9.0, 1.0), 180.0),
    ("ball", "sphere", {"radius": 0.3}, (14.0, -2.0), 0.0),
    ("corner", "trihedral", {"size": 0.2}, (18.0, 3.0), 180.0),
    ("post", "cylinder", {"radius": 0.1, "height": 1.0}, (22.0, -1.0), 0.0),
)


def worlds(quick: bool) -> Outcome:
    """Turn and shift whole scenes with their radar: detections keep range and level within the stated errors."""
    rows: list[Row] = []
    home = _detections(0.0, (0.0, 0.0))
    rows.append(Row("targets found at home", len(_CORNERS), len(home), 0, "", "every body is above the noise"))
    turns: Sequence[tuple[float, tuple[float, float]]] = (
        (0.0, (1e4, -1e4)), (37.0, (0.0, 0.0)), (90.0, (0.0, 0.0)), (217.3, (-5e3, 8e3)),
    )  # fmt: skip
    for yaw, at in turns[: 2 if quick else 4]:
        there = _detections(yaw, at)
        name = f"scene turned by {yaw:g} deg, at ({at[0]:g}, {at[1]:g}) m"
        rows.append(Row(f"{name}: detections", len(home), len(there), 0, "", "symmetry: motion"))
        if len(there) != len(home):
            continue
        apart = float(np.abs(there[:, 0] - home[:, 0]).max())
        rows.append(at_most(f"{name}: range", apart, 0.01, "m", "symmetry: motion"))
        over = np.abs(there[:, 1] - home[:, 1]) - (there[:, 2] + home[:, 2])
        rows.append(at_most(f"{name}: level beyond both stated errors", float(over.max()), 0.0, "dB", "stated errors"))
    return Outcome(rows)


def _detections(yaw_deg: float, at: tuple[float, float]) -> Floats:
    """Return range [m], power [dBW] and stated error [dB] of the bodies' detections, by range, in a turned scene."""
    turn, shift = rotation(np.radians(yaw_deg)), np.array([*at, 0.0])
    bodies = [
        Body(
            name=name, shape=shape, params=params, yaw_deg=own + yaw_deg,
            position=turn @ np.array([*place, 0.5]) + shift,
        )
        for name, shape, params, place, own in _CORNERS
    ]  # fmt: skip
    radar = _RADAR | {"position": (turn @ np.array([0.0, 0.0, 0.7]) + shift).tolist(), "yaw_deg": yaw_deg}
    result = simulate(Scene(bodies=bodies, radar=radar), seed=1)
    found = result.detections
    errors = np.array([r.error_db for r in result.provenance])
    table = np.column_stack([found.range, 10.0 * np.log10(found.power), errors])
    off = [np.abs(table[:, 0] - np.hypot(*place)) for _, _, _, place, _ in _CORNERS]
    return np.array([table[np.argmin(o)] for o in off if o.min() < 0.5]).reshape(-1, 3)


def exact_angles(quick: bool) -> Outcome:
    """Turn a body and the view together: the RCS stays the same at all angles, though faces are edge-on."""
    rows: list[Row] = []
    box = trimesh.creation.box((0.2, 0.1, 0.15))
    corner = build("dihedral", {"size": 0.1, "height": 0.1})
    dihedral = trimesh.Trimesh(corner.vertices, corner.faces, process=False)
    angles = np.linspace(0.0, 350.0, 6 if quick else 36) + 0.3
    for name, mesh, view in (("box", box, 0.0), ("box from behind", box, 180.0), ("dihedral", dihedral, 0.0)):
        here = _sigma(rcs(mesh, FREQUENCY, view, tolerance_db=0.05))
        levels = []
        for yaw in angles:
            turned = mesh.copy()
            turned.apply_transform(trimesh.transformations.rotation_matrix(np.radians(yaw), (0, 0, 1)))
            levels.append(_sigma(rcs(turned, FREQUENCY, view + yaw, tolerance_db=0.05)))
        worst = float(np.abs(np.array(levels) - here).max())
        rows.append(at_most(f"{name}, {len(angles)} turns: level", worst, 0.1, "dB", "symmetry: rotation"))
    return Outcome(rows)


def _sigma(found: Rcs) -> float:
    """Return an RCS in dBsm; NaN where it is none."""
    return float(10.0 * np.log10(found.sigma)) if found.sigma > 0.0 else float("nan")


def tessellation(quick: bool) -> Outcome:
    """Mesh curved bodies coarsely and finely, and flat ones with shallow folds: the stated error covers this."""
    rows: list[Row] = []
    for half, view in (((0.25, 0.25, 0.25), (20.0, 10.0)), ((0.3, 0.2, 0.15), (30.0, 15.0))):
        exact = _ellipsoid(half, *view)
        for divisions in (3, 4) if quick else (2, 3, 4, 5):
            ball = trimesh.creation.icosphere(subdivisions=divisions)
            ball.apply_scale(half)
            found = rcs(ball, FREQUENCY, view[0], view[1], max_rays=300_000)
            off = abs(_sigma(found) - 10.0 * np.log10(exact))
            name = f"ellipsoid {half[0]:g} x {half[1]:g} x {half[2]:g} m of {len(ball.faces)} facets"
            rows.append(_covered(name, off, found, "closed form: geometrical optics of an ellipsoid"))
    rng = np.random.default_rng(5)
    for i in range(2 if quick else 6):
        hull = trimesh.convex.convex_hull(rng.normal(size=(60, 3)) * (0.3, 0.2, 0.15))
        smooth = rcs(hull, FREQUENCY, 10.0 + 47.0 * i, 8.0, max_rays=300_000)
        flat = rcs(hull, FREQUENCY, 10.0 + 47.0 * i, 8.0, max_rays=300_000, crease_deg=0.0)
        off = abs(_sigma(smooth) - _sigma(flat))
        rows.append(_covered(f"hull {i}, its folds as they are", off, smooth, "flat facets"))
    return Outcome(rows)


def _covered(name: str, off: float, found: Rcs, truth: str) -> Row:
    """Return the check that the stated error covers a deviation; an unknown error covers any."""
    stated = float(found.error_db)
    if not np.isfinite(stated):
        return at_most(name, 0.0, 0.0, "dB", truth, f"{off:.2f} dB off, stated: not converged")
    return at_most(name, off, stated, "dB", f"{truth}, within the stated error")


def _ellipsoid(half: Sequence[float], azimuth_deg: float, elevation_deg: float) -> float:
    """Return sigma [m2] of an ellipsoid of half axes [m] by geometrical optics (Knott 2004, sec. 5.2: pi rho1 rho2)."""
    az, el = np.radians([azimuth_deg, elevation_deg])
    d = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    return float(np.pi * np.prod(np.square(half)) / np.sum(np.square(d * half)) ** 2)


def open_sheets(quick: bool) -> Outcome:
    """View open sheets from both sides: both faces scatter alike."""
    rows: list[Row] = []
    plate = sheet(rectangle((0, -0.05, -0.05), (0, 0.1, 0), (0, 0, 0.1)), mend=False)
    turned = make_mesh(plate.vertices, plate.faces[:, ::-1])
    for name, mesh in (("plate", plate), ("plate wound the other way", turned)):
        for view in (0.0, 12.0, 180.0, 192.0):
            found = rcs(mesh, FREQUENCY, view, tolerance_db=0.05)
            exact = plate_far(0.1, 0.1, (view + 90.0) % 180.0 - 90.0)
            rows.append(same_db(f"{name} from {view:g} deg", float(found.sigma), exact, 0.05, "closed form"))
    shell = trimesh.creation.icosphere(subdivisions=4, radius=0.2)
    half = shell.submesh([np.flatnonzero(shell.triangles_center[:, 0] > 0.0)], append=True)
    found = rcs(half, FREQUENCY, 0.0, tolerance_db=0.1, max_bounces=1)
    rows.append(same_db("half a shell from its hump", float(found.sigma), np.pi * 0.04, 0.5, "limit: pi a2"))
    whole = rcs(half, FREQUENCY, 180.0, tolerance_db=0.1, max_bounces=1)
    rows.append(same_db("half a shell from its hollow", float(whole.sigma), np.pi * 0.04, 0.5, "limit: pi a2"))
    return Outcome(rows)


def on_a_plane(quick: bool) -> Outcome:
    """Put the radar on the plane of a facet and inside a body: the RCS is right, or refused."""
    rows: list[Row] = []
    box = trimesh.creation.box((2.0, 1.0, 1.0))
    for name, at, inside in (
        ("on the plane of a face", (4.0, 0.5, 0.0), False),
        ("on the planes of two faces", (4.0, 0.5, 0.5), False),
        ("inside", (0.3, 0.1, 0.1), True),
    ):
        end = np.asarray(at)
        reach = float(np.linalg.norm(end))
        az, el = np.degrees(np.arctan2(end[1], end[0])), np.degrees(np.arcsin(end[2] / reach))
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                found = rcs(box, FREQUENCY, az, el, distance=reach, tolerance_db=0.1)
                told, finite = False, bool(np.isfinite(found.sigma))
            except (SceneError, ValueError):
                told, finite = True, True
        noisy = [w for w in said if issubclass(w.category, RuntimeWarning)]
        rows.append(Row(f"radar {name}: refused", float(inside), float(told), 0.0, "", "a radar stands in the air"))
        calm = float(finite and not noisy)
        rows.append(Row(f"radar {name}: finite, no divide warnings", 1.0, calm, 0.0, "", "limit"))
    aside = rcs(box, FREQUENCY, 0.0, distance=4.0, tolerance_db=0.05)
    near = rcs(box, FREQUENCY, 1e-9, distance=4.0, tolerance_db=0.05)
    rows.append(same_db("a hair off the axis", float(near.sigma), float(aside.sigma), 1e-3, "continuity"))
    return Outcome(rows)


REGIMES = (
    Regime("worlds", "Scenes turned and shifted with their radar", worlds),
    Regime("exact_angles", "Bodies turned to exact angles with the view", exact_angles),
    Regime("tessellation", "Tessellations, and folds under the crease angle", tessellation),
    Regime("open_sheets", "Open sheets from both sides", open_sheets),
    Regime("on_a_plane", "Radar on a facet's plane, or inside", on_a_plane),
)
