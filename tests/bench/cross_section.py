"""Cross-sections to a tolerance: how often `rcs` reaches it, and whether what it states covers the true error.

`python -m bench.cross_section VIEWS SEED BODY ...` judges so many views, drawn by the seed, of bodies: flat:WHAT, or
smooth:WHAT with folds under 20 deg smooth, where WHAT is a mesh file or the number of a random body. What the mesh
leaves open is not judged: the stated error is its numerical part."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import trimesh

import raychan as rc
from bench.measure import Row
from raychan.poses import direction
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of, mesh_of
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry
from raychan.world.meshes.mesh import make_mesh

_F, _BOUNCES, _TOLERANCE_DB = 77e9, 3, 0.5
_WEIGHTS = np.array([1.0, 1.5, 2.25])  # of three launches in the truth, the finest last


def cross_section(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Random bodies of primitives with flat and with smooth facets, 0.5 dB asked for: the truth is the mean of three
    finer launches of the whole body, and counts where it is known to a quarter of a dB."""
    seeds, views, most, finer = (2, 4, 1_000_000, 4) if quick else (5, 48, 6_000_000, 6)
    for seed in range(1, seeds + 1):
        for smooth in (False, True):
            start, mesh = perf_counter(), _assembled(seed, smooth)
            found = np.array([*_judged(mesh, seed, views, most, finer)])
            yield _row(f"body {seed}{', smooth' * smooth}", found, perf_counter() - start)


def _judged(mesh: Any, seed: int, views: int, most: int, finer: int) -> Iterator[tuple[float, float, float, int]]:
    """Give the stated and the true error of views of a mesh, that of the truth [dB], and rays."""
    rng, geometry = np.random.default_rng(seed), Geometry(facets_of(mesh, "pec", _F))
    for az, el in zip(rng.uniform(-180.0, 180.0, views), rng.uniform(-5.0, 20.0, views), strict=True):
        got = rc.rcs(mesh, _F, az, el, tolerance_db=_TOLERANCE_DB, max_rays=most)
        true, unsure = _truth(geometry, az, el, finer)
        yield float(got.numerical_db), abs(10.0 * np.log10(float(got.sigma) / true)), unsure, int(got.rays)


def _row(name: str, found: np.ndarray, seconds: float) -> Row:
    """Return what is told of views (n, 4) as `_judged` gives them."""
    stated, off, unsure, rays = found.T
    known = np.isfinite(stated) & (unsure < 0.5 * _TOLERANCE_DB)
    told = known & (off > 1e-3)
    reached, covered = float(np.mean(stated <= _TOLERANCE_DB)), float(np.mean((off <= stated)[known]))
    return Row(
        "cross_section", f"{name}, {len(found)} views", seconds, bar="stated 90 %, covered 95 %",
        met=reached >= 0.9 and covered >= 0.95, more={
            "stated_within_tolerance": reached, "covered": covered, "truths_known": int(known.sum()),
            "median_stated_over_true": float(np.median((stated / off)[told])) if told.any() else None,
            "rays_mean": float(rays.mean()),
        },
    )  # fmt: skip


def _assembled(seed: int, smooth: bool = False) -> Any:
    """Return five boxes, cylinders and spheres through each other, with flat facets, or smooth normals where the folds
    are flat enough, which are then taken as known: the mesh leaves nothing open."""
    rng, parts = np.random.default_rng(seed), []
    for _ in range(5):
        a, b, c = rng.uniform(0.1, 0.6, 3)
        kinds = (
            lambda a=a, b=b, c=c: trimesh.creation.box((a, b, c)),
            lambda a=a, b=b: trimesh.creation.cylinder(a / 2.0, b, sections=48),
            lambda a=a: trimesh.creation.icosphere(3, a / 2.0),
        )
        place = np.eye(4)
        part = kinds[rng.integers(3)]()
        if rng.random() < 0.5:
            place = trimesh.transformations.random_rotation_matrix(rng.random(3))
        place[:3, 3] = rng.uniform(-0.5, 0.5, 3)
        parts.append(part.apply_transform(place))
    whole = trimesh.util.concatenate(parts)
    if smooth:
        return _known(whole, None)
    return make_mesh(whole.vertices, whole.faces, normals=np.repeat(whole.face_normals[:, None], 3, axis=1))


def _known(mesh: Any, crease_deg: float | None) -> Any:
    """Return a mesh, or that of a file, with the normals that `rcs` estimates by a crease angle as known ones."""
    read = mesh_of(mesh, crease_deg)
    return make_mesh(read.vertices, read.faces, normals=read.normals)


def _truth(geometry: Geometry, az: float, el: float, steps: int) -> tuple[float, float]:
    """Return sigma [m^2] by the mean of the last three of so many launches, and its standard error [dB]."""
    leg = Leg(end=direction(np.radians(az), np.radians(el)), far=True)
    # In the truth weak tubes are cut finer than `rcs` cuts them.
    rules = [replace(x, relative=0.03 * 0.5**i) for i, x in enumerate(refinements(geometry, _F))][steps - 3 : steps]
    found = np.array([scattering(geometry, leg, leg, _F, _BOUNCES, rule)[:, 0, 0].sum() for rule in rules])
    share = _WEIGHTS / _WEIGHTS.sum()
    mean = share @ found
    error = np.sqrt(share @ np.abs(found - mean) ** 2 / (1.0 / (share @ share) - 1.0))
    return float(4.0 * np.pi * abs(mean) ** 2), float(20.0 * np.log10(1.0 + error / abs(mean)))


def main() -> None:
    """Judge views of bodies, and tell every one."""
    views, seed = map(int, sys.argv[1:3])
    every = []
    for name in sys.argv[3:]:
        how, _, what = name.partition(":")
        smooth = {"flat": False, "smooth": True}[how]
        mesh = _assembled(int(what), smooth) if what.isdecimal() else _known(what, None if smooth else 0.0)
        for one in _judged(mesh, seed, views, 6_000_000, 6):
            every.append(one)
            print(
                f"{how} {Path(what).stem}: stated {one[0]:.3f}, true {one[1]:.3f} +- {one[2]:.3f} dB, {one[3]:,} rays",
                flush=True,
            )
    row = _row("all bodies", np.array(every), 0.0)
    print(row.name, row.bar, row.met, row.more)


if __name__ == "__main__":
    main()
