"""Arrays: exact distances in the near field, plane waves in the far field, and what each transmitter sends."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import SMALL, echoes, make_radar

import raychan as rc
from raychan.radar.array import Wavefronts, virtual_elements, wavefronts
from raychan.radar.wave_kernels import lengthen
from raychan.records import POINT, REFLECT, Paths
from raychan.signal.baseband import synthesize
from raychan.units import C0, db

HALF = 0.5 * SMALL.wavelength


def scattered(points, amplitudes=None, rates=0.0) -> Paths:
    """Paths from the origin over point scatterers (n, 3) [m] and back."""
    points = np.asarray(points, float)
    n, far = len(points), np.linalg.norm(points, axis=1)
    look = points / far[:, None]
    return Paths.of(
        length=2.0 * far,
        amplitude=np.ones(n, complex) if amplitudes is None else np.asarray(amplitudes, complex),
        length_rate=2.0 * np.broadcast_to(rates, n),
        departure=look,
        arrival=look,
        body=np.zeros((n, 1), np.int16),
        part=np.zeros((n, 1), np.int16),
        kind=np.full((n, 1), POINT, np.int8),
        vertices=points[:, None],
        body_names=("point",),
        part_names=("",),
        tx=np.zeros(3),
        rx=np.zeros(3),
    )


def test_near_field_delays_are_exact_distances_to_a_nanometre():
    rng = np.random.default_rng(1)
    points, tx, rx = rng.normal(size=(200, 3)) * 10.0 ** rng.uniform(-1, 3, (200, 1)), *rng.normal(size=(2, 3)) * 0.2
    far = np.linalg.norm(points, axis=1)
    fronts = wavefronts(
        np.stack([np.zeros_like(points), points, np.zeros_like(points)], axis=1),
        np.zeros(200, int), points / far[:, None], points / far[:, None], 2.0 * far,
    )  # fmt: skip
    true = np.linalg.norm(points - tx, axis=1) + np.linalg.norm(points - rx, axis=1) - 2.0 * far
    longer, factor = fronts.between(tx, rx)
    np.testing.assert_allclose(longer, true, rtol=0.0, atol=1e-9)
    spread = far**2 / (np.linalg.norm(points - tx, axis=1) * np.linalg.norm(points - rx, axis=1))
    np.testing.assert_allclose(factor, spread, rtol=1e-9)


def test_far_field_is_the_plane_wave():
    """The curvature |e|^2 / 2R goes to nothing: a picometre at 1e9 m."""
    look, e = np.array([[0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]), np.array([0.01, -0.04, 0.02])
    plane, curved, factor = np.zeros(2), look @ e, np.ones(2)
    lengthen(np.full(2, 1e9), look, e, plane, factor)
    np.testing.assert_allclose(plane, -look @ e, rtol=0.0, atol=2e-12)
    lengthen(np.full(2, 1e3), look, e, curved, factor)
    np.testing.assert_allclose(curved, ((e @ e) - (look @ e) ** 2) / 2e3, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("mirror", [True, False])
def test_paths_without_a_scatterer_end_at_each_element_of_both_arrays(mirror):
    """One mirror, and line of sight: the length between two elements is that to the image of the transmitter."""
    rng = np.random.default_rng(2)
    n = np.array([0.36, 0.48, 0.8])
    tx, rx, a, b = np.zeros(3), np.array([1.2, 0.4, 0.1]), *rng.normal(size=(2, 3)) * 0.05

    def shown(x):
        return x - 2.0 * ((x - 3.0 * n) @ n) * n if mirror else x

    length = float(np.linalg.norm(shown(tx) - rx))
    look = (shown(tx) - rx) / length
    leave = -(look - 2.0 * (look @ n) * n) if mirror else -look
    waves = Wavefronts(look[None], np.array([length]), leave[None], np.array([length]), np.array([True]))
    true = np.linalg.norm(shown(tx + a) - (rx + b)) - length
    longer, factor = waves.between(a, b)
    assert longer[0] == pytest.approx(true, abs=1e-9) and factor[0] == pytest.approx(length / (length + true))


def test_waves_arrive_from_the_image_of_the_scatterer_over_the_mirrors_behind_it():
    stops = np.array([[[0, 0, 0], [3, 4, 0], [3, 16, 0], [3, 16, 5], [3, 16, 5]]], float)
    waves = wavefronts(stops, np.array([1]), np.ones((1, 3)), np.ones((1, 3)), np.array([22.0]))
    assert (waves.tx_radius[0], waves.radius[0]) == (17.0, 5.0)
    assert REFLECT != POINT


@pytest.mark.parametrize("method", ["direct", "nufft"])
def test_each_pair_of_elements_has_the_samples_of_a_radar_with_its_own_path(method):
    """A point 0.5 m away, well inside 2 D^2 / lambda of the array, moving; both multiplexings against one echo each."""
    point, rate = np.array([[0.48, 0.14, 0.02]]), 4.0
    tx, rx = rc.uniform_array(2, 8 * HALF), rc.uniform_array(4, HALF)
    far = float(np.linalg.norm(point))
    for multiplexing in ("tdm", "ddm"):
        slots = 2 if multiplexing == "ddm" else None
        radar = make_radar(SMALL, elements=rx, tx_elements=tx, multiplexing=multiplexing, ddm_slots=slots)
        got = synthesize(scattered(point, rates=rate), radar, method=method, tolerance=1e-7).samples
        for j in range(4):
            alone = []
            for i in range(2):
                out, back = (float(np.linalg.norm(point[0] - x)) for x in (tx[i], rx[j]))
                length = out + back
                turn = far**2 / (out * back) * np.exp(-2j * np.pi * SMALL.carrier * (length - 2.0 * far) / C0)
                alone.append(
                    synthesize(echoes(0.5 * length, rate, turn), make_radar(SMALL), method="direct").samples[0]
                )
            if multiplexing == "tdm":
                want = np.where((np.arange(64) % 2 == 0)[:, None], *alone)
            else:
                want = alone[0] + alone[1] * (-1.0) ** np.arange(64)[:, None]
            assert db((np.abs(got[j] - want) ** 2).max()) < -95.0


def test_samples_from_any_chirp_on_are_those_of_the_whole_frame():
    tx = rc.uniform_array(3, 4 * HALF)
    for multiplexing in ("tdm", "ddm"):
        radar = make_radar(SMALL, elements=rc.uniform_array(2, HALF), tx_elements=tx, multiplexing=multiplexing)
        paths = scattered([[8.0, 1.0, 0.0], [5.0, -2.0, 0.0]], [1.0, 0.5j], [3.0, -7.0])
        whole, late = synthesize(paths, radar, method="direct").samples, 7 * SMALL.repetition * paths.length_rate
        moved = paths.replace(
            length=paths.length + late, amplitude=paths.amplitude * np.exp(-2j * np.pi / SMALL.wavelength * late)
        )
        rest = synthesize(moved, radar, method="direct", first=7).samples
        # The wave fronts' radius is that of the start: it moves the phase of a curved wave by less than this.
        np.testing.assert_allclose(rest[:, : 64 - 7], whole[:, 7:], atol=1e-4)


def test_virtual_elements_of_a_mimo_array_are_one_uniform_line():
    line = rc.mimo_array(3, 8, HALF)
    virtual = virtual_elements(line["tx_elements"], line["elements"])
    np.testing.assert_allclose(virtual, rc.uniform_array(24, HALF), atol=1e-15)
    np.testing.assert_allclose(make_radar(SMALL, **line, multiplexing="tdm").virtual_elements, virtual, atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"elements": np.zeros((0, 3))}, "elements"),
        ({"elements": [[0.0, 1.95, 0.0]]}, "1.95 m off"),
        ({"tx_elements": np.zeros((2, 3))}, "'tdm' or 'ddm'"),
        ({"multiplexing": "fdm"}, "none, tdm, ddm"),
        ({"multiplexing": "tdm", "ddm_slots": 4}, "ddm_slots"),
        ({"tx_elements": np.zeros((3, 3)), "multiplexing": "ddm", "ddm_slots": 2}, "from 3"),
    ],
)
def test_arrays_that_cannot_be_are_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        make_radar(SMALL, **changes)


@pytest.mark.parametrize("bad", [{"n": 0}, {"n": 2.5}, {"spacing": 0.0}, {"axis": "x"}])
def test_lines_that_cannot_be_are_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        rc.uniform_array(**({"n": 4, "spacing": HALF} | bad))
