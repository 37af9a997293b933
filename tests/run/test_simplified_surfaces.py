"""Levels over simplified surfaces are those over the whole mesh, within what is stated, at a fraction of the rays."""

from __future__ import annotations

import numpy as np
import pytest
from support.fine_surfaces import ball, ellipsoid, torus
from truth import mie

import raychan as rc
from raychan.units import C0

F = 24e9
LOOKS = [10.0, 47.0, 80.0], [5.0, 20.0, 2.0]


def db(x):
    return 10.0 * np.log10(x)


def test_a_sphere_of_many_facets_is_mies_at_the_rays_of_one_of_few():
    """0.05 dB from 82,000 facets, at less than 20,000 rays; from 1,300 on its facets no longer count."""
    true = mie.rcs(0.5, 2.0 * np.pi * F / C0)
    got = rc.rcs(ball(6, known=False), F, 10.0, 5.0, tolerance_db=0.05)
    assert got.merged.startswith("81,920 facets merged into ")
    assert got.rays < 20_000
    assert abs(db(got.sigma / true)) < min(0.05, got.error_db)


@pytest.mark.parametrize(
    ("mesh", "tolerance"),
    [(ellipsoid(known=False), 0.5), (ellipsoid(known=False), 1.0), (torus(), 1.0)],
    ids=["ellipsoid-0.5", "ellipsoid-1.0", "torus-1.0"],
)
def test_simplified_bodies_have_the_cross_section_of_the_whole_mesh_within_the_error_stated(mesh, tolerance):
    ours = rc.rcs(mesh, F, *LOOKS, tolerance_db=tolerance, max_bounces=2)
    whole = rc.rcs(mesh, F, *LOOKS, tolerance_db=tolerance, max_bounces=2, simplify=False)
    assert ours.merged and not whole.merged
    assert ours.converged.all()
    assert (np.abs(db(ours.sigma / whole.sigma)) <= ours.error_db + whole.error_db).all()


def test_what_merging_may_change_is_in_the_error_stated():
    got = rc.rcs(ball(6), F, 10.0, 5.0, tolerance_db=1.0)
    deviation = float(got.merged.split("deviation ")[1].split()[0]) * 1e-6
    assert got.error_db >= -20.0 * np.log10(1.0 - 4.0 * np.pi * F / C0 * 0.99 * deviation)


def scene(simplify, **model):
    """Return a ball that partly hides another, before a plate: direct echoes, two bounces and shadows."""
    radar = {
        "position": [0.0, 0.0, 1.0],
        "noise": False,
        "waveform": {"carrier_ghz": 24.0, "bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 32, "samples": 128},
    }
    bodies = [
        rc.Body(name="near", mesh=ball(6), position=(8.0, 0.3, 1.0), velocity=(-3.0, 0.0, 0.0)),
        rc.Body(name="far", mesh=ball(6, 0.8), position=(12.0, -0.4, 1.2)),
        rc.Body(
            name="wall", shape="plate", params={"width": 4.0, "height": 3.0}, position=(16.0, 1.0, 1.0), yaw_deg=180.0
        ),
    ]
    return rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2, "simplify": simplify, **model})


def test_detections_of_simplified_bodies_are_those_of_the_whole_meshes_within_the_error_stated():
    ours, whole = (rc.simulate(scene(s, tolerance_db=0.5)) for s in (True, False))
    a, b = ours.detections, whole.detections
    assert sum("facets merged into" in text for text in ours.warnings) == 1
    assert not any("facets merged into" in text for text in whole.warnings)
    rows = [int(np.argmin(np.abs(b.range - r) + np.abs(b.rate - v))) for r, v in zip(a.range, a.rate, strict=True)]
    near = (np.abs(b.range[rows] - a.range) < 0.3) & a.converged & b.converged[rows]
    assert near.sum() >= 3
    off = np.abs(db(a.power / b.power[rows]))[near]
    assert (off <= (a.error_db + b.error_db[rows])[near]).all()
    assert ours.stats["tubes"] < 0.5 * whole.stats["tubes"]


def test_stages_and_run_trace_the_same_surface():
    made = scene(True, tolerance_db=2.0)
    routes = rc.trace(made, tolerance_db=1.0)
    assert len(routes.geometry.facets.body) == len(rc.trace(made, tolerance_db=1.0).geometry.facets.body)
    assert len(routes.geometry.facets.body) < 0.5 * 2 * 81_920


def test_the_ledger_tells_what_smoothing_the_whole_mesh_changes_not_what_its_merged_facets_would():
    body = rc.Body(name="ball", mesh=ball(6, known=False), position=(8.0, 0.3, 1.0))
    entries = []
    for simplify in (True, False):
        made = scene(simplify, tolerance_db=1.0)
        one = rc.Scene(bodies=[body], radar=made.radar_table, model=made.model)
        entries.append(rc.simulate(one).ledger["tessellation"])
    assert entries[0].how == entries[1].how
    assert entries[0].level_db == pytest.approx(entries[1].level_db, abs=0.5)
