"""Meshes as they come from outside: flattened, folded, doubled, torn, too large, too small, or no meshes at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh

ENDINGS = (".ply", ".stl", ".obj", ".glb")


def base(rng: Any) -> trimesh.Trimesh:
    """Return a small body of a few hundred facets at most."""
    kind = rng.integers(6)
    if kind == 0:
        made = trimesh.creation.box(rng.uniform(0.02, 0.3, 3))
    elif kind == 1:
        made = trimesh.creation.icosphere(int(rng.integers(0, 3)), rng.uniform(0.02, 0.15))
    elif kind == 2:
        made = trimesh.creation.cylinder(rng.uniform(0.01, 0.1), rng.uniform(0.02, 0.3), sections=12)
    elif kind == 3:
        made = trimesh.creation.torus(rng.uniform(0.05, 0.1), rng.uniform(0.01, 0.04), 12, 8)
    elif kind == 4:
        made = trimesh.Trimesh(rng.normal(0.0, 0.05, (12, 3)), rng.integers(0, 12, (16, 3)), process=False)
    else:
        made = trimesh.convex.convex_hull(rng.normal(0.0, 0.05, (20, 3)))
    return trimesh.Trimesh(np.array(made.vertices), np.array(made.faces), process=False)


def broken(mesh: trimesh.Trimesh, rng: Any) -> trimesh.Trimesh:
    """Return the mesh with one thing done to it that a file may hold."""
    v, f = np.array(mesh.vertices), np.array(mesh.faces)
    kind = rng.integers(14)
    if not len(v) or not len(f):  # nothing is left to break
        return mesh
    if kind == 0:  # flattened
        v[:, rng.integers(3)] *= float(rng.choice([0.0, 1e-12, 1e-6]))
    elif kind == 1:  # folded onto itself
        axis = rng.integers(3)
        v[:, axis] = np.abs(v[:, axis])
    elif kind == 2:  # faces doubled, some turned
        f = np.concatenate([f, f[: len(f) // 2], f[::2, ::-1]])
    elif kind == 3:  # torn
        f = f[rng.random(len(f)) < 0.6]
    elif kind == 4:  # NaN, infinity
        v[rng.integers(len(v)), rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf, 1e300])
    elif kind == 5:  # empty
        f = f[:0]
    elif kind == 6:  # faces on one edge
        f = np.concatenate([f, [[f[0, 0], f[0, 1], k] for k in rng.integers(0, len(v), 5)]])
    elif kind == 7:
        v *= 10.0 ** rng.integers(-12, 10)
    elif kind == 8:
        v += rng.normal(0.0, 1.0, 3) * 10.0 ** rng.integers(0, 9)
    elif kind == 9:  # needles
        v[f[0, 1]] = v[f[0, 0]] + 1e-12
    elif kind == 10:  # a spike
        v[rng.integers(len(v))] *= 1e3
    elif kind == 11:  # all corners apart, none shared
        v, f = v[f].reshape(-1, 3), np.arange(3 * len(f)).reshape(-1, 3)
    elif kind == 12:  # two bodies through each other
        f = np.concatenate([f, f + len(v)])
        v = np.concatenate([v, v + 0.3 * np.ptp(v, axis=0)])
    return trimesh.Trimesh(v, f, process=False)


def written(folder: Path, name: str, rng: Any) -> Path:
    """Write a mesh, perhaps broken, perhaps under another format's ending, perhaps cut off; return its file."""
    mesh = base(rng)
    for _ in range(int(rng.integers(0, 3))):
        mesh = broken(mesh, rng)
    ending = str(rng.choice(ENDINGS))
    try:
        data = mesh.export(file_type=ending[1:])
    except Exception:  # trimesh itself cannot write it
        ending, data = ".obj", "".join(f"v {x} {y} {z}\n" for x, y, z in mesh.vertices) + "f 1 2 3\n"
    content = data.encode() if isinstance(data, str) else bytes(data)
    luck = rng.random()
    if luck < 0.05:
        ending = str(rng.choice([*ENDINGS, ".txt", ".gltf", ""]))
    elif luck < 0.1:
        content = content[: int(rng.integers(len(content)))]
    elif luck < 0.13:
        content = bytes(rng.integers(0, 256, 300, np.uint8))
    file = folder / f"{name}{ending}"
    file.write_bytes(content)
    return file
