"""The sums of a body by source: what is traced again replaces exactly that, and means of launches scatter less."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from support.targets import F, view
from truth import corner

from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import BodyLaunch, BySource
from raychan.run.cross_section.single_body import facets_of
from raychan.run.cross_section.source_sums import SourceSums
from raychan.tracing.legs import Leg
from raychan.tracing.sources import depth_of
from raychan.world.geometry import Geometry


@pytest.mark.parametrize("rx", [(20.0, 7.0), (-12.0, 9.0)])
def test_all_sources_traced_again_by_the_same_rule_are_the_whole_launch(rx):
    """Monostatic and bistatic, bounce by bounce."""
    geometry = Geometry(facets_of(corner.mesh(corner.trihedral_faces(0.1, True)), "pec", F))
    ends = tuple(Leg(end=view(*x)[0], far=True) for x in ((20.0, 7.0), rx))
    leg, out = ends if rx != (20.0, 7.0) else (ends[0], ends[0])
    launch, before = BodyLaunch(geometry, (leg, out), F, 3), geometry.rays
    rule = next(islice(refinements(geometry, F), 1, None))
    whole = launch.whole(rule)
    again = launch.again(rule, whole.source)
    assert set(depth_of(whole.source)) == {1, 2, 3}
    size = np.abs(whole.amplitude.sum(axis=0)).max()
    # Each ray belongs to one source.
    assert whole.rays.sum() + again.rays.sum() == pytest.approx(geometry.rays - before)
    # What is too weak to be cut is judged by the whole field found, which the launch itself had only in part.
    np.testing.assert_allclose(again.by_bounce(3), whole.by_bounce(3), atol=2e-3 * size)


def test_the_mean_of_launches_that_scatter_is_off_by_its_stated_standard_error():
    """Truth 1 for each of 400 sources, and complex Gaussian scatter of 0.1 in each launch."""
    rng, n = np.random.default_rng(3), 400
    source = np.arange(n, dtype=np.int64) + (2 << 31)

    def launched():
        a = 1.0 + 0.1 * (rng.normal(size=n) + 1j * rng.normal(size=n)) / np.sqrt(2.0)
        return BySource(source, a[:, None, None] * np.ones((2, 2)), np.ones(n))

    sums, rows = SourceSums.of(launched(), launched(), (0, 0), 1), np.arange(n)
    for _ in range(6):
        sums = sums.joined(rows, [launched()])
    means = np.flatnonzero(sums.scatters)
    off = np.abs(sums.sums.amplitude[means, 0, 0] - 1.0)
    rms = float(np.sqrt(np.mean(off**2)))
    assert len(means) > 0.8 * n
    assert rms < 0.065
    # Both components of a complex mean err alike, and the doubt is of one.
    assert np.linalg.norm(sums.doubt_of[means]) * np.sqrt(2.0 / len(means)) == pytest.approx(rms, rel=0.3)


def test_a_bias_that_does_not_shrink_doubles_the_doubt():
    source = np.array([1 << 31], np.int64)
    levels = [BySource(source, np.full((1, 2, 2), x, complex), np.ones(1)) for x in (1.0, 1.1, 1.2)]
    sums = SourceSums.of(levels[0], levels[1], (0, 0), 1).joined(np.array([0]), [levels[2]])
    assert sums.value == pytest.approx(1.2)
    assert sums.off(1.8) == pytest.approx(1.8 * 0.2)


def changed(changes, rays):
    """Return the sums of sources that changed by so much from 1 and took so many rays, after two launches."""
    source, n = np.arange(len(rays), dtype=np.int64) + (2 << 31), len(rays)
    before, after = (np.ones(n), 1.0 + np.asarray(changes))
    return SourceSums.of(
        *(
            BySource(source, a[:, None, None] * np.ones((2, 2), complex), np.array(rays, float))
            for a in (before, after)
        ),
        (0, 0),
        1,
    )


def test_rays_go_to_the_sources_that_are_most_off_for_what_they_take():
    """Variance over rays: 1e-2 / 100, 1e-2 / 1e4, 1e-4 / 5 and 1e-4 / 1000: only sources are traced that are within a
    tenth of the best one is traced, whatever the rest leaves open."""
    sums = changed([0.1, 0.1, 0.01, 0.01], [100.0, 10_000.0, 5.0, 1000.0])
    assert list(sums.to_refine(1.8, 1e-3, 1e6, 12)) == [0, 2]
    # What rays do not suffice for leaves them to others.
    assert list(sums.to_refine(1.8, 1e-3, 100.0, 12)) == [2]


def test_a_source_by_the_last_rule_leaves_the_rays_to_others():
    sums = changed([0.1, 0.02], [100.0, 100.0])
    ended = replace(sums, rule=np.array([11, 1]))
    assert list(sums.to_refine(1.8, 1e-3, 1e6, 12)) == [0]
    assert list(ended.to_refine(1.8, 1e-3, 1e6, 12)) == [1]
    assert not len(ended.to_refine(1.8, 1e-3, 1e6, 2))


def test_the_stated_error_of_few_noisy_sources_covers_99_percent():
    """Sums of 1 to 3 sources of complex Gaussian scatter, 4 to 7 launches by one rule each: the component along the sum
    is off by more than stated in about 1 % of 4000 draws."""
    rng, beyond, draws = np.random.default_rng(8), 0, 4000
    for _ in range(draws):
        n, launches = int(rng.integers(1, 4)), int(rng.integers(4, 8))
        noise = 0.1 * (rng.normal(size=(launches, n)) + 1j * rng.normal(size=(launches, n)))
        spread = (np.abs(noise - noise.mean(axis=0)) ** 2).mean(axis=0)
        count = np.full(n, float(launches))
        off = replace(
            SourceSums.of(*2 * (level(n),), (0, 0), 1),
            doubt_of=np.sqrt(0.5 * spread / (launches - 1.0)).astype(complex),
            mean=np.array([count, count, count, count]),
            scatters=np.ones(n, bool),
        ).off(1.8)
        beyond += abs(noise.mean(axis=0).sum().real) > off
    assert beyond / draws == pytest.approx(0.01, abs=0.006)


def level(n):
    """Return a launch of n sources of amplitude 1."""
    return BySource(np.arange(n, dtype=np.int64) + (2 << 31), np.ones((n, 2, 2), complex), np.ones(n))


def _sums(*levels):
    """Return the sums of sources after launches of all of them that gave some levels (s,) each."""
    source = np.arange(len(levels[0]), dtype=np.int64) + (2 << 31)
    found = [BySource(source, np.asarray(x, complex)[:, None, None] * np.ones((2, 2)), np.ones(len(x))) for x in levels]
    sums = SourceSums.of(found[0], found[1], (0, 0), 1)
    for one in found[2:]:
        sums = sums.joined(np.arange(len(source)), [one])
    return sums


def test_a_part_that_two_launches_missed_alike_is_a_bias_and_no_scatter():
    """What finds more of it from launch to launch is not held to a mean with those that missed it."""
    sums = _sums([1.0], [0.999], [1.1], [1.4])
    assert not sums.scatters[0]
    assert sums.value == 1.4
    # What the last two launches found, more than half of it in the second.
    assert abs(sums.doubt_of[0]) == pytest.approx(0.401)


def test_sources_that_bring_most_are_confirmed_by_a_third_launch():
    """All but the weakest, which may be left out together; none twice, none beyond the rays left."""
    sums = _sums([1.0, 0.5j, 0.02, 0.01], [1.0, 0.5j, 0.02, 0.01])
    assert list(sums.to_confirm(0.03, np.inf)) == [0, 1]
    assert list(sums.to_confirm(0.029, np.inf)) == [0, 1, 2]
    assert list(sums.to_confirm(0.03, float(sums.next_rays[0]))) == [0]
    again = sums.joined(np.array([0]), [BySource(sums.sums.source[:1], np.ones((1, 2, 2), complex), np.ones(1))])
    assert list(again.to_confirm(0.03, np.inf)) == [1]
