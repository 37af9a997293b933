"""Weak tubes: what is left out of routes, and which long patches are not cut, are bounded by what they bring."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.channel.paths import join, paths_of
from raychan.geometry.patch_cuts import edge_to_cut
from raychan.run.receiver import noise_of_cell, quiet_map
from raychan.run.rules import first_rule
from raychan.signal.baseband import synthesize
from raychan.tracing import contributions
from raychan.tracing.contributions import Contributions, amplitudes
from raychan.tracing.launch import launch_tubes
from raychan.tracing.legs import Leg
from raychan.tracing.radiation import Phases, phases_of
from raychan.tracing.solver import Launch
from raychan.tracing.stats import Stats
from raychan.tracing.tubes import Refinement
from raychan.world.geometry import geometry_of

RULE = Refinement(wavenumber=1600.0, floor=1.0, cell=0.5)
LIMIT = contributions._SILENT * RULE.floor


def weak_tubes(n, seed):
    """Return phases of tubes of all sizes in some cells, and the bodies on which they lie."""
    rng = np.random.default_rng(seed)
    in_phase = 10.0 ** rng.uniform(-6.0, 1.0, n)
    six = rng.uniform(0.0, 2.0 * np.pi, (n, 1)) + rng.uniform(0.0, 0.1, (n, 6))
    flat = np.zeros((n, 3))
    return Phases(six, flat, in_phase, in_phase, flat[:, 0], rng.uniform(10.0, 13.0, n)), rng.integers(0, 4, n)


@pytest.mark.parametrize("seed", range(5))
def test_what_leaves_no_route_adds_up_to_less_than_the_limit_in_each_cell_on_each_body(seed):
    ph, body = weak_tubes(3000, seed)
    share = np.random.default_rng(seed + 9).uniform(0.2, 1.0, 3000)
    each = amplitudes(ph) * share
    kept = Contributions(RULE).that_return(each, ph.length, body.astype(np.int16))
    gone = np.setdiff1d(np.arange(3000), kept)
    assert len(gone) > 1000
    assert (np.diff(kept) > 0).all()
    cell = (ph.length / RULE.cell).astype(int)
    for c, b in {*zip(cell.tolist(), body.tolist(), strict=True)}:
        own = gone[(cell[gone] == c) & (body[gone] == b)]
        assert abs(each[own].sum()) <= LIMIT * (1.0 + 1e-9)
        assert np.linalg.norm(each[own]) <= LIMIT * (1.0 + 1e-9)
        left = kept[(cell[kept] == c) & (body[kept] == b)]
        # The weakest go first.
        assert not len(own) or np.abs(each[own]).max() <= np.abs(each[left]).min() * (1.0 + 1e-9)


def test_all_routes_are_kept_of_few_tubes_and_where_there_is_no_noise():
    ph, body = weak_tubes(200, 1)
    assert len(Contributions(RULE).that_return(amplitudes(ph), ph.length, body.astype(np.int16))) == 200
    ph, body = weak_tubes(3000, 1)
    silent = Refinement(wavenumber=1600.0, floor=0.0, cell=0.5)
    assert len(Contributions(silent).that_return(amplitudes(ph), ph.length, body.astype(np.int16))) == 3000


def test_tubes_in_phase_are_not_left_out_however_small_they_are():
    """A finely tessellated mirror: each facet is a thousandth of the limit, all together are far above it."""
    ph, body = weak_tubes(100_000, 2)
    small, far = np.full(len(body), 1e-3 * LIMIT), np.full(len(body), 10.1)
    flat = Phases(np.zeros_like(ph.six), ph.bend, small, small, ph.rough, far)
    kept = Contributions(RULE).that_return(amplitudes(flat), far, np.zeros(len(body), np.int16))
    assert 1e-3 * LIMIT * (len(body) - len(kept)) <= LIMIT * (1.0 + 1e-9)


def test_routes_left_out_change_no_cell_of_a_street_by_half_of_the_noise(monkeypatch):
    scene = rc.Scene(
        bodies=[
            rc.Body("ground", shape="ground", material="asphalt"),
            rc.Body("car", shape="car", position=(14.0, 1.0, 0.0), yaw_deg=12.0, velocity=(-3.0, 0.0, 0.0)),
            rc.Body("post", shape="lamp_post", position=(18.0, -3.0, 0.0)),
        ],
        radar={"waveform": {"bandwidth_mhz": 500.0, "chirp_us": 40.0, "chirps": 64, "samples": 128}},
        model={"max_bounces": 3, "tolerance_db": 0.5},
    )  # fmt: skip
    geometry, radar = geometry_of(scene), scene.radar
    rule = first_rule(radar, scene.processing, scene.model)

    def traced():
        launch = Launch(geometry, scene.points(0.0), rule)
        batches = [b for b, _ in launch.whole(Stats(), lambda routes: routes)]
        paths = join([paths_of(b, geometry.facets, radar, radar.waveform.carrier) for b in batches])
        return sum(len(b.kind) for b in batches), synthesize(paths, radar).samples

    few, some = traced()
    monkeypatch.setattr(contributions, "_SILENT", 0.0)
    many, every = traced()
    assert few < 0.75 * many
    off = quiet_map(every - some, radar, scene.processing) / noise_of_cell(radar, scene.processing)
    assert np.sqrt(off.max()) < 0.5


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7])
def test_long_patches_are_cut_while_they_may_bring_more_all_in_phase(share):
    """What a patch may bring is that of `radiation.phases`, for antennas alike in all directions."""
    scene = rc.Scene(bodies=[rc.Body("ball", shape="sphere", params={"radius": 2.0}, position=(9.0, 2.0, 1.0))])
    geometry, leg = geometry_of(scene, 0.5), Leg(end=np.array([0.0, 0.0, 0.5]))
    facets = geometry.facets
    facet = np.arange(len(facets.body), dtype=np.int32)
    bary = np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy()
    shape = facets.vertices, facets.normals, geometry.edge_curvature
    ends = leg.image, leg.far, leg.image, leg.far
    may = phases_of(geometry, leg, leg, launch_tubes(geometry, leg, facet, bary), RULE).in_phase
    least = np.quantile(may, share) * (share > 0.0)
    # Nothing is cut but for its length.
    limits = RULE.wavenumber, 1e9, 1e9, 1e-4, 1e9, np.inf, False, least, np.inf
    edge = edge_to_cut(facet, bary, *shape, *ends, *limits)
    assert (edge[may > 1.001 * least] >= 0).all()
    assert (edge[may < 0.999 * least] < 0).all()
