"""Meshes broken at random: flattened, folded, duplicated, flipped, spiked; needles, T-junctions and the like."""

from __future__ import annotations

import numpy as np
import trimesh


def _primitive(rng):
    made = [
        lambda: trimesh.creation.box(rng.uniform(0.3, 2.0, 3)),
        lambda: trimesh.creation.icosphere(subdivisions=int(rng.integers(0, 4)), radius=rng.uniform(0.2, 1.0)),
        lambda: trimesh.creation.cylinder(
            rng.uniform(0.1, 0.8), rng.uniform(0.2, 2.0), sections=int(rng.integers(3, 40))
        ),
        lambda: trimesh.creation.cone(rng.uniform(0.1, 0.8), rng.uniform(0.2, 2.0), sections=int(rng.integers(3, 30))),
        lambda: trimesh.creation.torus(1.0, rng.uniform(0.1, 0.6), major_sections=24, minor_sections=12),
    ]
    return made[rng.integers(len(made))]()


def _flatten(rng, v, f):
    v[:, rng.integers(3)] *= 0.0 if rng.random() < 0.5 else 10.0 ** rng.uniform(-12, -6)
    return v, f


def _fold(rng, v, f):
    axis = rng.integers(3)
    v[:, axis] = np.abs(v[:, axis] - np.median(v[:, axis]))
    return v, f


def _duplicate(rng, v, f):
    again = f[rng.random(len(f)) < 0.5]
    return v, np.concatenate([f, again[:, ::-1] if rng.random() < 0.5 else again])


def _copy(rng, v, f):
    """Add a copy with vertices of its own, displaced by less than 0.1 mm."""
    return np.concatenate([v, v + 10.0 ** rng.uniform(-12, -4)]), np.concatenate([f, f + len(v)])


def _flip(rng, v, f):
    turned = rng.random(len(f)) < 0.3
    f[turned] = f[turned][:, ::-1]
    return v, f


def _weld(rng, v, f):
    """Faces that name other vertices than theirs."""
    some = rng.random(f.shape) < 0.05
    f[some] = rng.integers(len(v), size=some.sum())
    return v, f


def _spike(rng, v, f):
    rows = rng.integers(len(v), size=3)
    v[rows] += rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(0, 4)
    return v, f


def _needles(rng, v, f):
    """Each edge of some faces ends a billionth of a metre beside another corner."""
    rows = rng.integers(len(f), size=6)
    at = len(v) + np.arange(6)
    return np.concatenate([v, v[f[rows, 0]] + 1e-9]), np.concatenate(
        [f, np.stack([f[rows, 0], f[rows, 1], at], axis=1)]
    )


def _junctions(rng, v, f):
    """T-junctions: one of two faces about an edge is cut there."""
    row = int(rng.integers(len(f)))
    a, b, c = f[row]
    v = np.concatenate([v, 0.5 * (v[a] + v[b])[None]])
    return v, np.concatenate([np.delete(f, row, 0), [[a, len(v) - 1, c], [len(v) - 1, b, c]]])


def _through(rng, v, f):
    """Add a copy, rotated, that passes through the mesh."""
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    return np.concatenate([v, v @ turn.T]), np.concatenate([f, f + len(v)])


def _holes(rng, v, f):
    return v, f[rng.random(len(f)) < 0.7] if len(f) > 3 else f


def _collapse(rng, v, f):
    """All corners of some faces at one place."""
    f[rng.random(len(f)) < 0.1] = f[0, 0]
    return v, f


def _scale(rng, v, f):
    return v * 10.0 ** rng.uniform(-4, 3), f


HOW = (
    _flatten,
    _fold,
    _duplicate,
    _copy,
    _flip,
    _weld,
    _spike,
    _needles,
    _junctions,
    _through,
    _holes,
    _collapse,
    _scale,
)


def broken_mesh(seed: int) -> trimesh.Trimesh:
    """Return a primitive with one to four faults."""
    rng = np.random.default_rng(seed)
    solid = _primitive(rng)
    v, f = np.array(solid.vertices, float), np.array(solid.faces)
    for how in rng.choice(len(HOW), size=rng.integers(1, 5)):
        v, f = HOW[how](rng, v, f)
    return trimesh.Trimesh(v, f, process=False)
