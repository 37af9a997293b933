"""Cross-section of a ball that a plate hides in part, against physical optics integrated across the line of sight."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

import raychan as rc
from raychan.poses import direction
from raychan.units import C0

RADIUS = 0.25
LOW, HIGH = np.array([0.99, 0.02, -0.12]), np.array([1.01, 0.32, 0.18])


def part_of_ball(look, k, rows=400, points=300):
    """Return the amplitude [m] of what the box from LOW to HIGH leaves of the ball, seen along look (3,)."""
    across = np.cross([0.0, 0.0, 1.0], look)
    across /= np.linalg.norm(across)
    corners = np.array([[x, y, z] for x in (LOW[0], HIGH[0]) for y in (LOW[1], HIGH[1]) for z in (LOW[2], HIGH[2])])
    seen = corners @ np.stack([across, np.cross(look, across)]).T
    hull = seen[ConvexHull(seen).vertices]
    breaks = np.unique(np.clip(np.r_[-RADIUS, RADIUS, hull[:, 1]], -RADIUS, RADIUS))
    at, weight = np.polynomial.legendre.leggauss(points)
    down, each = np.polynomial.legendre.leggauss(rows)
    total = 0.0
    for y0, y1 in pairwise(breaks):
        for y, part in zip(0.5 * (y0 + y1) + 0.5 * (y1 - y0) * down, 0.5 * (y1 - y0) * each, strict=True):
            half = np.sqrt(RADIUS**2 - y**2)
            ends = zip(hull, np.roll(hull, -1, axis=0), strict=True)
            cuts = [p[0] + (q[0] - p[0]) * (y - p[1]) / (q[1] - p[1]) for p, q in ends if (p[1] - y) * (q[1] - y) < 0]
            open_to = [(-half, half)] if not cuts else [(-half, min(half, *cuts)), (max(-half, *cuts), half)]
            for a, b in open_to:
                if b > a:
                    # Nodes lie dense at the ends, where the ball falls away.
                    x = 0.5 * (a + b) + 0.5 * (b - a) * np.sin(0.5 * np.pi * at)
                    width = 0.25 * np.pi * (b - a) * np.cos(0.5 * np.pi * at)
                    total += part * (weight * width) @ np.exp(2j * k * np.sqrt(np.maximum(half**2 - x**2, 0.0)))
    return k / (2.0 * np.pi) * total


def part_of_box(look, k):
    """Return the amplitude [m] of the box, seen along look (3,)."""
    size, middle, total = HIGH - LOW, 0.5 * (LOW + HIGH), 0.0
    for i in range(3):
        others = [j for j in range(3) if j != i]
        centre = middle.copy()
        centre[i] += 0.5 * np.sign(look[i]) * size[i]
        face = np.prod([size[j] * np.sinc(k * look[j] * size[j] / np.pi) for j in others])
        total += abs(look[i]) * face * np.exp(2j * k * (centre @ look))
    return k / (2.0 * np.pi) * total


def ball_and_plate(subdivisions):
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=RADIUS)
    plate = trimesh.creation.box(extents=HIGH - LOW)
    plate.apply_translation(0.5 * (LOW + HIGH))
    return trimesh.util.concatenate([ball, plate])


def off_and_stated(subdivisions, azimuth):
    """Return how far a level is off [dB], what is stated [dB], and the rays."""
    k, look = 2.0 * np.pi * 24e9 / C0, direction(np.radians(azimuth), np.radians(1.0))
    true = 4.0 * np.pi * abs(part_of_ball(look, k) + part_of_box(look, k)) ** 2
    got = rc.rcs(ball_and_plate(subdivisions), 24e9, azimuth, 1.0, max_bounces=1, tolerance_db=0.1)
    return abs(10.0 * np.log10(got.sigma / true)), got.error_db, got.rays


@pytest.mark.parametrize("azimuth", [6.0, 12.0])
def test_a_level_that_nearly_cancels_is_within_its_stated_error(azimuth):
    # The plate by itself falls to a tenth and less of what its facets bring; 1.4 and 2.2 million rays were not enough
    # while parts too small for these were left uncut.
    off, stated, rays = off_and_stated(4, azimuth)
    assert off < stated < 0.15
    assert rays < 200_000


@pytest.mark.parametrize("azimuth", [5.0, 6.0])
def test_a_shadow_falls_on_the_curved_surface_not_on_its_flat_facets(azimuth):
    # Facets of 7 cm lie up to 2 mm under the ball: 0.3 and 1.0 dB were lost beside the shadow.
    off, stated, _ = off_and_stated(3, azimuth)
    assert off < stated < 0.15
