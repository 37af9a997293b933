"""Cross-sections of wavy sheets, whose edges cross inflections, against physical optics integrated over the sheet.

`python tests/run/test_wavy_sheets.py SEED COUNT` prints each: level beside a flat sheet's, how far off, stated [dB].
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

import raychan as rc
from raychan.units import C0
from raychan.world.meshes.mesh import Mesh, make_mesh

_POINTS = 700  # along a side: 0.4 mm, a twentieth of half a wavelength where it is steepest


@dataclass(frozen=True)
class Sheet:
    """z = a (sin(K u + p) + b sin(m K v + q)) over a square, u and v turned; seen from +z, a little aside."""

    side: float
    height: float
    wave: float
    cross: tuple[float, float]
    phase: tuple[float, float]
    turn: float

    def at(self, x, y):
        """Return the height [m] and its slopes."""
        c, s, k = np.cos(self.turn), np.sin(self.turn), 2.0 * np.pi / self.wave
        u, v = k * (c * x + s * y) + self.phase[0], self.cross[1] * k * (c * y - s * x) + self.phase[1]
        b, m = self.cross
        along, across = self.height * k * np.cos(u), self.height * k * b * m * np.cos(v)
        return self.height * (np.sin(u) + b * np.sin(v)), c * along - s * across, s * along + c * across

    def mesh(self, cells: int) -> Mesh:
        """Return the sheet in triangles with its true normals, its z along x."""
        q = np.linspace(-0.5 * self.side, 0.5 * self.side, cells + 1)
        x, y = (a.ravel() for a in np.meshgrid(q, q, indexing="ij"))
        z, zx, zy = self.at(x, y)
        i = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
        n = cells + 1
        faces = np.concatenate([np.stack([i, i + n, i + n + 1], 1), np.stack([i, i + n + 1, i + 1], 1)])
        up = np.stack([np.ones_like(z), -zx, -zy], 1)
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        return make_mesh(np.stack([z, x, y], 1), faces, normals=up[faces])

    def sigma(self, look, k):
        """Return the RCS [m^2] of physical optics, and of a flat sheet seen straight on; NaN where parts are dark."""
        q = (np.arange(_POINTS) + 0.5) / _POINTS * self.side - 0.5 * self.side
        x, y = np.meshgrid(q, q)
        z, zx, zy = self.at(x, y)
        facing = (look[0] - zx * look[1] - zy * look[2]) * (self.side / _POINTS) ** 2
        whole = (facing * np.exp(2j * k * (z * look[0] + x * look[1] + y * look[2]))).sum()
        flat = k**2 / np.pi * self.side**4
        return (k**2 / np.pi * abs(whole) ** 2 if facing.min() > 0.0 else np.nan), flat


def judged(seed: int, count: int):
    """Give the level beside a flat sheet's, how far the RCS is off and what is stated [dB] of random sheets."""
    rng = np.random.default_rng(seed)
    while count:
        f = rng.choice([24e9, 77e9])
        sheet = Sheet(
            side=rng.uniform(0.1, 0.3),
            height=1e-3 * rng.uniform(0.3, 3.0) * (77e9 / f) ** 0.7,
            wave=rng.uniform(0.04, 0.15),
            cross=(rng.choice([0.0, 0.5, 1.0]), rng.uniform(0.7, 1.7)),
            phase=tuple(rng.uniform(0.0, 2.0 * np.pi, 2)),
            turn=rng.uniform(0.0, np.pi),
        )
        az, el, cells = *rng.uniform(-12.0, 12.0, 2), int(rng.integers(10, 60))
        a, e = np.radians([az, el])
        look = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        true, flat = sheet.sigma(look, 2.0 * np.pi * f / C0)
        if not np.isfinite(true):
            continue
        count -= 1
        got = rc.rcs(sheet.mesh(cells), f, az, el, max_bounces=1)
        yield 10.0 * np.log10(true / flat), abs(10.0 * np.log10(float(got.sigma) / true)), float(got.error_db)


def test_wavy_sheets_are_within_what_is_stated():
    """Edges over inflections left straight are 0.46 dB off in the median."""
    level, off, stated = np.array(list(judged(3, 24))).T
    known = np.isfinite(stated) & (level > -45.0)
    assert known.sum() >= 10 and np.mean((off <= stated)[known]) >= 0.9
    assert np.median(off[known]) < 0.05 and (off <= 2.0 * stated)[known].all()


if __name__ == "__main__":
    for row in judged(*map(int, sys.argv[1:])):
        print("{:7.1f} {:8.3f} {:8.3f}".format(*row))
