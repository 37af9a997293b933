"""What fringe fields of edges may change of a cross-section, held to the method of moments and to symmetry."""

import numpy as np
import pytest
import trimesh
from truth.strip import strip

from raychan.em.fringe import fringe
from raychan.run.rcs import rcs
from raychan.world.shapes import build

WAVE = 299_792_458.0 / 10e9


def plate(width, height, move=0.0):
    """Return a plate across x, its middle moved along y and z."""
    y, z = 0.5 * width * np.array([-1, 1, 1, -1]), 0.5 * height * np.array([-1, -1, 1, 1])
    points = np.stack([np.zeros(4), y + move, z + move], axis=1)
    return trimesh.Trimesh(points, [[0, 1, 2], [0, 2, 3]], process=False)


def test_a_long_plate_states_what_its_long_edges_do_to_a_strip():
    """Both edges of a strip as wide as the plate, seen in the plane across them."""
    for width, degrees in ((3.0, 5.0), (1.2, 10.0), (0.7, 0.0)):
        found = rcs(plate(width * WAVE, 40.0 * WAVE), 10e9, degrees)
        angle, size = np.radians(degrees), 2.0 * np.pi * width
        phi = np.array([0.5 * np.pi + angle, 0.5 * np.pi - angle])
        turn = np.exp(1j * size * np.sin(angle) * np.array([1.0, -1.0]))
        # V: the field runs along the long edges, and across the far shorter ones.
        edges = abs(2.0 * (fringe(np.full(2, 2.0), phi, phi)[0] * turn).sum())
        wanted = -20.0 * np.log10(1.0 - edges / abs(strip(size, angle, angle, "E")[1]))
        assert found.edges_db == pytest.approx(wanted, rel=0.15)


def test_what_is_stated_covers_strips_by_the_method_of_moments():
    rng, within = np.random.default_rng(5), []
    for _ in range(60):
        width, angle = np.exp(rng.uniform(np.log(2.0), np.log(40.0))), rng.uniform(0.0, 1.3)
        along = rng.choice(["E", "H"])
        whole, optics = strip(width, angle, angle, along, max(60, int(10 * width)))
        long = plate(width / (2.0 * np.pi) * WAVE, 40.0 * WAVE)
        found = rcs(long, 10e9, np.degrees(angle), polarization="VV" if along == "E" else "HH")
        stated = np.inf if np.isnan(found.edges_db) else float(found.edges_db)
        within.append(abs(20.0 * np.log10(abs(whole / optics))) <= stated)
    assert np.mean(within) >= 0.9


def test_a_body_without_edges_has_none_and_a_small_plate_is_not_known():
    assert rcs(build("sphere", {"radius": 0.1}), 10e9, 0.0).edges_db == 0.0
    big, small = (rcs(plate(x * WAVE, x * WAVE), 10e9, 0.0) for x in (20.0, 0.4))
    assert big.edges_db < 0.15 and small.edges_db > 2.0


def test_edges_do_not_depend_on_where_the_body_is_nor_on_which_end_sends():
    near, far = (rcs(plate(0.2, 0.3, move), 10e9, 15.0, 5.0) for move in (0.0, 7.0))
    assert near.edges_db == pytest.approx(float(far.edges_db), rel=1e-3)
    one, other = (
        rcs(build("box", {"length": 0.3, "width": 0.2, "height": 0.25}), 10e9, a, rx_azimuth_deg=b)
        for a, b in ((5.0, -12.0), (-12.0, 5.0))
    )
    assert one.edges_db == pytest.approx(float(other.edges_db), rel=1e-6)


def test_edges_behind_another_part_of_the_body_do_not_count():
    """A large plate before a small one: those of the small one are hidden."""
    screen, small = plate(1.0, 1.0), plate(0.2, 0.2)
    small.apply_translation([-0.3, 0.0, 0.0])
    both = trimesh.util.concatenate([screen, small])
    alone, found = rcs(screen, 10e9, 3.0), rcs(both, 10e9, 3.0)
    assert found.edges_db == pytest.approx(float(alone.edges_db), rel=1e-3)
