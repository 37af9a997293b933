"""Double bounces between curved bodies: geometrical optics of their true surfaces, whatever their tessellation; the
same over a mirror leg and by tubes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.optimize import minimize

import raychan as rc
from raychan.tracing import legs
from raychan.units import C0

WAVE = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=16, n_samples=256)
WAVELENGTH = C0 / 77e9


def scene(bodies, **model):
    radar = rc.Radar(
        WAVE, position=(0.0, 0.0, 0.8), antenna=rc.IsotropicAntenna(front=False), power=1.0, noise_figure_db=5.0
    )
    return rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2, "tolerance_db": 0.5} | model)


def both_ways(circles, upright):
    """Return amplitude and range [m] of the double bounce of two circles (x, y, radius) in the radar's plane, of balls
    or of cylinders, both ways in phase.

    Fermat's path; the front's two widths grow by its curvatures, to which a mirror of radius r adds 2 / (r cos i) in
    the plane of incidence and 2 cos i / r across it (Deschamps 1972, Proc. IEEE 60).
    """

    def way(angles):
        on = [np.array(c[:2]) + c[2] * np.array([np.cos(a), np.sin(a)]) for c, a in zip(circles, angles, strict=True)]
        return [np.zeros(2), *on, np.zeros(2)]

    def length(angles):
        return sum(np.linalg.norm(b - a) for a, b in pairwise(way(angles)))

    tight = {"xatol": 1e-12, "fatol": 1e-14, "maxiter": 5000}
    stops = way(minimize(length, [-2.2, 2.2], method="Nelder-Mead", options=tight).x)
    steps = [np.linalg.norm(b - a) for a, b in pairwise(stops)]
    width, front = np.full(2, steps[0]), np.full(2, steps[0])
    for i, (x, y, radius) in enumerate(circles):
        cosine = abs((stops[i + 1] - stops[i]) @ (stops[i + 1] - [x, y])) / steps[i] / radius
        bend = np.array([2.0 / (radius * cosine), 0.0 if upright else 2.0 * cosine / radius])
        front = 1.0 / (1.0 / front + bend)
        width *= (front + steps[i + 1]) / front
        front += steps[i + 1]
    return WAVELENGTH / (2.0 * np.pi) / np.sqrt(width.prod()), 0.5 * sum(steps)


@pytest.mark.parametrize("max_sag", [1e-3, 3e-4])
@pytest.mark.parametrize(
    ("shape", "circles"),
    [
        ("sphere", [(5.0, 1.76, 0.6), (6.52, -2.44, 1.02)]),
        ("sphere", [(4.67, 2.02, 0.93), (5.84, -2.54, 1.17)]),
        ("cylinder", [(7.0, 1.3, 0.7), (5.4, -1.3, 0.45)]),
    ],
)
def test_levels_are_those_of_geometrical_optics_and_do_not_depend_on_the_tessellation(shape, circles, max_sag):
    bodies = []
    for name, (x, y, radius) in zip("ab", circles, strict=True):
        size = {"radius": radius, "max_sag": max_sag} | ({"height": 2.4} if shape == "cylinder" else {})
        place = x, y, 0.8 if shape == "sphere" else 0.0
        bodies.append(rc.Body(name=name, shape=shape, params=size, position=place))
    result = rc.simulate(scene(bodies))
    truth, reach = both_ways(circles, shape == "cylinder")
    found = [d for d in result.provenance if abs(d.range - reach) < 0.2]
    assert len(found) == 1
    assert found[0].error_db < 1.0
    chain = [tuple(result.paths.body_names[j] for j in row if j >= 0) for row in result.paths.body]
    ways = [
        sum(a for a, c in zip(result.paths.amplitude, chain, strict=True) if c == both)
        for both in (("a", "b"), ("b", "a"))
    ]
    # Without the noise of the map.
    off = 20.0 * np.log10(abs(sum(ways)) / truth)
    assert abs(off) <= found[0].error_db + 0.1
    for one in ways:
        assert abs(one / (0.5 * truth * np.exp(-4j * np.pi * reach / WAVELENGTH)) - 1.0) < 0.15


def test_tubes_over_a_plate_bring_what_a_mirror_leg_brings_to_a_ball(monkeypatch):
    """Plate, then ball: over the plate's image the ball is the first surface; by tubes it is the second."""
    ball = trimesh.creation.icosphere(3, 0.5)
    found = []
    for least in (0.5, 1e9):
        monkeypatch.setattr(legs, "_LEAST_AREA", least)
        size = {"length": 1.6, "width": 0.1, "height": 1.2}
        bodies = [
            rc.Body(name="ball", mesh=ball, position=(10.0, 0.5, 0.8)),
            rc.Body(name="plate", shape="box", params=size, position=(6.0, 2.15, 0.2)),
        ]
        paths = rc.simulate(scene(bodies, tolerance_db=0.1)).paths
        chain = [tuple(paths.body_names[j] for j in row if j >= 0) for row in paths.body]
        found.append(sum(a for a, c in zip(paths.amplitude, chain, strict=True) if c == ("plate", "ball")))
    assert abs(found[1] / found[0] - 1.0) < 0.1
