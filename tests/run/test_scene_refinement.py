"""Refinement where detections need it: levels lie within the stated error of much finer runs; budgets end it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support.boxes_and_balls import WAVEFORM, scene_of

import raychan as rc
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.refinement import budget as refinement_budget
from raychan.run.refinement import scene_refinement
from raychan.run.refinement.scene_refinement import SceneRefinement
from raychan.run.refinement.sourced_paths import SourcedPaths, changes, raised
from raychan.run.rules import step_rule
from raychan.tracing.sources import depth_of, launches
from raychan.tracing.stats import Further, Stats
from raychan.world.geometry import geometry_of


def fine(of, monkeypatch):
    """Return the result of a run that may cast eight times the rays, to 0.2 dB."""
    monkeypatch.setattr(refinement_budget, "_RAYS", 12.0)
    return rc.simulate(of, tolerance_db=0.2)


@pytest.mark.parametrize("seed", [3, 4])
def test_levels_lie_within_the_stated_error_of_a_much_finer_run(seed, monkeypatch):
    of = scene_of(seed)
    found = rc.simulate(of)
    truth = fine(of, monkeypatch)
    rows, columns = found.detections.cell.T
    off = np.abs(10.0 * np.log10(found.rdmap.power[rows, columns] / truth.rdmap.power[rows, columns]))
    known = found.detections.converged
    assert len(off) >= 3 and known.any()
    assert (off[known] <= found.detections.error_db[known]).mean() >= 0.75
    assert (off[known] <= found.detections.error_db[known] + 0.5).all()


def test_equal_runs_give_equal_bytes():
    a, b = rc.simulate(scene_of(4)), rc.simulate(scene_of(4))
    assert np.array_equal(a.cube.samples, b.cube.samples)
    assert np.array_equal(a.detections.error_db, b.detections.error_db)


def test_what_was_never_cut_is_in_doubt():
    """The first launch does not cut tubes that bounced: until they are traced again all of their field is in doubt."""
    of = scene_of(2)
    refinement = SceneRefinement(
        geometry_of(of), of.points(0.0), of.radar, of.processing, of.model, lambda *_: None, Stats()
    )
    first = refinement.first()
    deep = depth_of(first.source)[first.paths.trajectory] > 1
    assert deep.any()
    held = SourcedPaths(first.paths, first.source)
    assert np.sort(np.abs(held.doubtful.amplitude)) == pytest.approx(np.sort(np.abs(first.paths.amplitude[deep])))
    by = list(launches(np.unique(first.source[depth_of(first.source) > 1]), len(refinement.geometry.facets.body)))
    rule = step_rule(of.radar, of.processing, of.model, 0)
    paths, source = refinement._paths(first.launch.again([Further(rule.refinement, by)], refinement._carried)[0])
    change, _ = held.replace(paths, source, by)
    assert held.doubtful.amplitude.sum() == pytest.approx(change.amplitude.sum())
    assert len(held.now.amplitude) == len(paths.amplitude) + np.count_nonzero(~deep)


def test_speckle_stops_refinement_at_what_a_millimetre_changes():
    wanted, loose = (rc.simulate(scene_of(2, tolerance_db=0.1, speckle=x)) for x in (False, True))
    assert loose.stats["rays"] < wanted.stats["rays"]
    (line,) = (line for line in loose.warnings if "speckle (model.speckle)" in line)
    over = np.flatnonzero(loose.detections.error_db > 0.1) + 1
    told = re.search(r"numbers? ([\d, ]+) among them", line)
    assert len(over) and told and {str(i) for i in over} <= set(told[1].split(", "))


@pytest.mark.parametrize(
    ("key", "value", "word"),
    [("max_rays", 1, "rays"), ("max_seconds", 0.0, "seconds"), ("max_memory_mb", 1.0, "memory")],
)
def test_a_budget_ends_refinement_and_is_told(key, value, word):
    found = rc.simulate(scene_of(2, tolerance_db=0.1, **({"max_rays": 10**9} | {key: value})))
    assert found.stats["refinements"] == 1
    assert any(f"ended by the budget of {word} (model.{key})" in line for line in found.warnings)


def test_half_of_the_memory_of_the_machine_ends_refinement_and_is_told(monkeypatch):
    monkeypatch.setattr(refinement_budget, "allowed_memory", lambda: 1e6)
    found = rc.simulate(scene_of(2, tolerance_db=0.1, max_rays=10**9))
    assert found.stats["refinements"] == 1
    assert any("ended by half of this machine's memory" in line for line in found.warnings)


def test_a_first_launch_of_too_many_paths_is_made_coarser_and_refined(monkeypatch):
    fine = rc.simulate(scene_of(2, tolerance_db=0.1))
    monkeypatch.setattr(scene_refinement, "MOST", 40_000)
    found = rc.simulate(scene_of(2, tolerance_db=0.1))
    assert found.stats["refinements"] > 1
    assert any("a first launch for 0.1 dB brings more than" in line for line in found.warnings)
    off = 10.0 * np.log10(found.detections.power / fine.detections.power)
    assert (np.abs(off) <= fine.detections.error_db + found.detections.error_db).all()


def test_a_frame_of_too_many_paths_at_any_tolerance_says_that_it_is_not_refined(monkeypatch):
    monkeypatch.setattr(scene_refinement, "MOST", 20)
    found = rc.simulate(scene_of(2, tolerance_db=3.0))
    assert "refinements" not in found.stats and any("launched twice as a whole" in line for line in found.warnings)


@pytest.mark.parametrize(("allowed", "told"), [(0.0, True), (1e6, False)])
def test_a_run_says_where_tracing_took_longer_than_the_seconds_allowed(allowed, told):
    found = rc.simulate(scene_of(2, max_seconds=allowed))
    assert any("longer than the 0 s allowed (model.max_seconds)" in line for line in found.warnings) is told


def test_more_rays_state_smaller_errors():
    few, many = (rc.simulate(scene_of(1, tolerance_db=0.05, max_rays=n)) for n in (1, 2_000_000))
    assert many.stats["rays"] > few.stats["rays"]
    worst = [float(np.nanmax(np.where(r.detections.converged, r.detections.error_db, 20.0))) for r in (few, many)]
    assert worst[1] < worst[0]


def test_doubtful_paths_bring_at_least_what_a_cell_may_be_wrong_by():
    """Echoes at the place of each cell raise the sums there to the rms sums, and nothing elsewhere."""
    of = scene_of(2)
    refinement = SceneRefinement(
        geometry_of(of), of.points(0.0), of.radar, of.processing, of.model, lambda *_: None, Stats()
    )
    paths = refinement.first().paths
    response = PointSpread(of.radar.channel_waveform, of.processing.range_window, of.processing.rate_window)
    step = of.radar.waveform.range_resolution
    place = np.array([[10.0, 0.0, 1e-6], [10.0 + 12.0 * step, 0.0, 1e-6], [10.0 + 24.0 * step, 0.0, 1e-6]])
    source = np.full(len(paths.trajectories.kind), -1)
    before = np.abs(changes(response, paths, source, place).sum(axis=1))
    least = before * [2.0, 0.5, 3.0]
    more = raised(response, paths, place, least)
    after = np.abs(changes(response, more, np.full(len(more.trajectories.kind), -1), place).sum(axis=1))
    assert len(more.length) == len(paths.length) + 2
    assert after == pytest.approx(np.maximum(before, least), rel=0.02)
    # A cell so strong that no path tells in it, and one where nothing is in doubt.
    strong = np.array([[10.0, 0.0, 1.0]])
    more = raised(response, paths, strong, np.array([0.1]))
    assert np.abs(changes(response, more, np.full(len(more.trajectories.kind), -1), strong).sum()) == pytest.approx(0.1)
    assert len(raised(response, paths, strong, np.zeros(1)).length) == len(paths.length)
    # What lacks is less than what sums leave out beside the cell.
    more = raised(response, paths, strong, np.array([5e-4]))
    brought = changes(response, more, np.full(len(more.trajectories.kind), -1), strong * [1.0, 1.0, 1e-3])
    assert np.abs(brought).sum() == pytest.approx(5e-4, rel=0.02)


def test_no_error_below_a_tenth_of_the_tolerance_is_stated_of_a_plate():
    wave = rc.Waveform(carrier=24e9, bandwidth=150e6, chirp_duration=40e-6, n_chirps=16, n_samples=64)
    plate = rc.Body("plate", shape="plate", params={"width": 0.8, "height": 0.48}, position=(2.3, 0.2, 0), yaw_deg=180)
    radar = rc.Radar(wave, noise=False)
    found = rc.simulate(rc.Scene(bodies=[plate], radar=radar, model={"max_bounces": 1, "tolerance_db": 0.1})).detections
    assert 0.0095 < found.error_db[np.argmax(found.snr)] <= 0.1


def test_a_source_counts_by_the_factor_of_the_cell_that_it_matters_most_to():
    of = scene_of(2)
    refinement = SceneRefinement(
        geometry_of(of), of.points(0.0), of.radar, of.processing, of.model, lambda *_: None, Stats()
    )
    first = refinement.first()
    held = SourcedPaths(first.paths, first.source)
    own = np.unique(first.source[depth_of(first.source) > 1])[:1]
    for factor, share in ((3.0, 0.2), (0.7, 0.9), (2.0, 0.1)):
        held.doubt(own, np.array([factor]), np.array([share]))
    assert held._factor(own) == pytest.approx(0.7)
    assert held._factor(own + 1) == pytest.approx(1.0)


def test_a_scene_of_few_rays_may_still_be_refined():
    """Three and a half times a hundred rays is no budget: a lone corner needs some thousands."""
    model = rc.Scene(bodies=[], radar={"waveform": WAVEFORM}).model
    stats = Stats(rays=100)
    budget = refinement_budget.Budget(model, stats)
    stats.rays = 10_000
    assert budget.ended(stats, 20_000.0) == ""
    stats.rays = 2_000_000
    assert "max_rays" in budget.ended(stats, 20_000.0)


def test_finer_tolerances_may_take_more_rays():
    """At a quarter of a decibel four times as many as at one; coarser ones may take as many as that."""
    left = {}
    for tolerance in (3.0, 1.0, 0.5, 0.25):
        model = rc.Scene(bodies=[], radar={"waveform": WAVEFORM}, model={"tolerance_db": tolerance}).model
        stats = Stats(rays=4_000_000)
        left[tolerance] = refinement_budget.Budget(model, stats).left(stats)[0]
    assert left[3.0] == left[1.0] == pytest.approx(2e6)
    assert left[0.5] == pytest.approx(4e6) and left[0.25] == pytest.approx(8e6)


def test_a_step_of_few_rays_fits_into_what_is_left():
    model = rc.Scene(bodies=[], radar={"waveform": WAVEFORM}, model={"max_rays": 2_500_000}).model
    ended = []
    for rays in (1e6, 1e5):
        stats = Stats(rays=1_000_000)
        budget = refinement_budget.Budget(model, stats)
        stats.rays = 2_000_000
        ended.append(budget.ended(stats, rays))
    assert "max_rays" in ended[0] and ended[1] == ""


@pytest.mark.parametrize(("rays", "word"), [(100_000, ""), (400_000, "memory")])
def test_a_step_does_not_start_that_would_hold_more_paths_than_memory_allows(rays, word):
    """100,000 rays brought 50,000 paths beside 100,000: as many more take 180 MB, four times as many 315."""
    model = rc.Scene(bodies=[], radar={"waveform": WAVEFORM}, model={"max_memory_mb": 200.0}).model
    stats = Stats(rays=100_000)
    budget = refinement_budget.Budget(model, stats, paths=100_000)
    stats.rays = 200_000
    budget.pace.stepped(stats.rays, 150_000)
    assert (word in budget.ended(stats, rays)) and bool(budget.ended(stats, rays)) == bool(word)
    assert not budget.exceeded(model, stats, 222_000) and len(budget.exceeded(model, stats, 223_000)) == 1


def test_rays_beyond_the_budget_are_told():
    model = rc.Scene(bodies=[], radar={"waveform": WAVEFORM}, model={"max_rays": 1000}).model
    budget = refinement_budget.Budget(model, Stats(rays=900))
    assert not budget.exceeded(model, Stats(rays=1000), 10)
    (line,) = budget.exceeded(model, Stats(rays=1001), 10)
    assert "1,001" in line and "1,000" in line and "model.max_rays" in line


@pytest.mark.parametrize(("rays", "why"), [(100_000, ""), (400_000, "seconds")])
def test_a_step_does_not_start_that_would_end_beyond_the_seconds(monkeypatch, rays, why):
    """200,000 rays took 2 of 5 s: 400,000 more would take 4 s. A run that began 2 s before has 1 s left."""
    now = [100.0]
    monkeypatch.setattr(refinement_budget.time, "perf_counter", lambda: now[0])
    model = rc.Scene(bodies=[], radar={"waveform": WAVEFORM}, model={"max_seconds": 5.0}).model
    stats = Stats(rays=100)
    budget, late = refinement_budget.Budget(model, stats), refinement_budget.Budget(model, stats, begun=98.0)
    stats.rays, now[0] = 200_100, 102.0
    for one, left in ((budget, 300_000), (late, 100_000)):
        one.pace.stepped(stats.rays, 0)
        assert one.left(stats)[0] == pytest.approx(left)
    ended = budget.ended(stats, rays)
    assert ended == "" if not why else (why in ended and "foreseen" in ended and "rays" not in ended)


@pytest.mark.parametrize(("yaw", "side"), [(160.0, 0.2), (180.0, 0.12), (190.0, 0.3)])
def test_a_corner_of_three_plates_is_found_and_of_the_closed_form(yaw, side):
    """Two triangles a face: the first launch must cut their tubes, or none of the six orders of bounces is seen."""
    corner = rc.Body("corner", shape="trihedral", params={"size": side}, position=(8, 0, 0.5), yaw_deg=yaw)
    radar = {"waveform": WAVEFORM, "position": (0, 0, 0.6), "power_dbm": 20.0}
    found = rc.simulate(rc.Scene(bodies=[corner], radar=radar), tolerance_db=1.0)
    fine = rc.simulate(rc.Scene(bodies=[corner], radar=radar), tolerance_db=0.1)
    assert len(found.detections.power) >= 1
    rows, columns = found.detections.cell[0]
    off = 10.0 * np.log10(found.rdmap.power[rows, columns] / fine.rdmap.power[rows, columns])
    assert abs(off) <= max(float(found.detections.error_db[0]), 0.2)
