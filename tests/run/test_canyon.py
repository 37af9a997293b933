"""Between two walls, or two panes, a wave may meet each several times: images in a row stand for all of its ways."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import C0

_WIDTH, _FAR = 3.0, 8.0


def _result(target: rc.Body, bounces: int, tolerance_db: float = 1.0) -> rc.Result:
    walls = [
        rc.Body(
            name=name,
            shape="plate",
            # All waves to the target meet these; the walls themselves return little, and are not what is refined.
            params={"width": 8.0, "height": 2.0},
            position=(4.9, side * _WIDTH / 2.0, 1.0),
            yaw_deg=-90.0 * side,
        )
        for name, side in (("left", 1.0), ("right", -1.0))
    ]
    wave = rc.Waveform(
        carrier=24e9, bandwidth=600e6, chirp_duration=30e-6, repetition=40e-6, n_chirps=16, n_samples=256
    )
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.IsotropicAntenna(front=True, polarization="V"))
    model = {"max_bounces": bounces, "tolerance_db": tolerance_db}
    return rc.simulate(rc.Scene(bodies=[target, *walls], radar=radar, model=model))


def _images(bounces: int) -> list[tuple[int, int]]:
    """Return by how many reflections ways go out and come back that meet so many surfaces at most, each of them as
    often as there are such ways: over either wall first."""
    pairs = [(a, b) for a in range(bounces) for b in range(bounces) if a + b < bounces]
    return [p for p in pairs for _ in range(2 ** sum(n > 0 for n in p))]


def _leg(reflections: int) -> float:
    return float(np.hypot(_FAR, reflections * _WIDTH))


def test_walls_with_the_radar_between_them_return_it_by_all_images() -> None:
    wall = {"shape": "plate", "params": {"width": 8.0, "height": 8.0}, "material": "pec"}
    walls = [
        rc.Body("ahead", position=(4.0, 0.0, 1.0), **wall),
        rc.Body("behind", position=(-3.0, 0.0, 1.0), **wall),
    ]
    wave = rc.Waveform(carrier=24e9, bandwidth=600e6, chirp_duration=30e-6, n_chirps=16, n_samples=256)
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.IsotropicAntenna())
    model = {"max_bounces": 4, "tolerance_db": 1.0}
    result = rc.simulate(rc.Scene(bodies=walls, radar=radar, model=model))
    # The length of each way to the image of the radar, in metres.
    apart = {"ahead": 8.0, "behind": 6.0, "ahead>behind": 14.0, "ahead>behind>ahead": 22.0, "behind>ahead>behind": 20.0}
    apart["ahead>behind>ahead>behind"] = 28.0
    names = np.array([">".join(x for x in row if x) for row in result.paths.bodies])
    for chain, length in apart.items():
        back = ">".join(reversed(chain.split(">")))
        rows = np.isin(names, [chain, back])
        ways = 2.0 if back != chain else 1.0
        level = ways * C0 / wave.middle / (4.0 * np.pi * length)
        assert abs(result.paths.amplitude[rows].sum()) == pytest.approx(level, rel=0.12), chain


@pytest.mark.parametrize("bounces", [4, 5])
def test_a_target_is_seen_over_all_images_and_each_falls_by_the_law_of_distances(bounces: int) -> None:
    point = rc.Body("target", shape="sphere", params={"radius": 0.01}, position=(_FAR, 0.0, 1.0), rcs_dbsm=10.0)
    paths = _result(point, bounces).paths
    rows = np.flatnonzero((paths.bodies == "target").any(axis=1))
    expected = sorted((_leg(a) + _leg(b), 1.0 / (_leg(a) * _leg(b))) for a, b in _images(bounces))
    found = np.array(sorted(zip(paths.length[rows], np.abs(paths.amplitude[rows]), strict=True)))
    assert found[:, 0] == pytest.approx([x for x, _ in expected], abs=1e-6)
    assert found[:, 1] / found[0, 1] == pytest.approx([x / expected[0][1] for _, x in expected], rel=1e-4)


def test_a_ball_is_as_strong_over_each_image_as_a_point_of_its_cross_section() -> None:
    ball = rc.Body("target", shape="sphere", params={"radius": 0.1, "max_sag": 1e-4}, position=(_FAR, 0.0, 1.0))
    paths = _result(ball, 4, tolerance_db=0.25).paths
    names = [">".join(x for x in row if x) for row in paths.bodies]
    levels = {n: abs(paths.amplitude[[n == m for m in names]].sum()) for n in set(names)}
    for reflections, chain in enumerate(("target", "left>target", "left>right>target", "left>right>left>target")):
        far = _leg(reflections) - 0.1
        assert levels[chain] / levels["target"] == pytest.approx((_FAR - 0.1) / far, rel=0.03)


def _slab(material: rc.Material, frequency: float, cosine: float) -> tuple[complex, complex]:
    """Return reflection at a pane's face and transmission through its middle plane, E across the plane of incidence,
    by the matrix of a layer."""
    k = 2.0 * np.pi * frequency / C0
    inside = np.sqrt(material.eps(frequency) - (1.0 - cosine**2) + 0j)
    turn = k * material.thickness * inside
    b = np.cos(turn) + 1j * np.sin(turn) * cosine / inside
    c = 1j * inside * np.sin(turn) + np.cos(turn) * cosine
    through = 2.0 * cosine / (cosine * b + c)
    return (cosine * b - c) / (cosine * b + c), through * np.exp(1j * k * material.thickness * cosine)


def test_a_point_behind_two_panes_is_seen_over_all_ways_to_and_fro_in_their_gap() -> None:
    normal, gap, far = np.array([np.cos(0.6), np.sin(0.6), 0.0]), 0.11, 9.0
    material = rc.Material(eps_r=6.0, sigma=0.05, thickness=0.004)
    panes = [
        rc.Body(
            name=f"pane_{i}",
            shape="plate",
            params={"width": 6.0, "height": 6.0},
            material=material,
            position=np.array([1.3, 0.0, 1.0]) + i * gap * normal,
            yaw_deg=np.degrees(0.6),
        )
        for i in range(2)
    ]
    point = rc.Body("target", shape="sphere", params={"radius": 0.01}, position=(far, 0.0, 1.0), rcs_dbsm=20.0)
    wave = rc.Waveform(
        carrier=77e9, bandwidth=150e6, chirp_duration=30e-6, repetition=40e-6, n_chirps=16, n_samples=128
    )
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.IsotropicAntenna(front=True, polarization="V"))
    scene = rc.Scene(bodies=[point, *panes], radar=radar, model={"max_bounces": 5, "tolerance_db": 1.0})
    paths = rc.simulate(scene).paths
    rows = np.flatnonzero((paths.bodies == "target").any(axis=1))

    def leg(trips: int) -> tuple[float, complex]:
        way = np.array([far, 0.0, 0.0]) + 2.0 * trips * gap * normal
        length = float(np.linalg.norm(way))
        back, through = _slab(material, wave.middle, abs(way @ normal) / length)
        return length, through**2 * back ** (2 * trips) * np.exp(-2j * np.pi * wave.carrier * length / C0) / length

    pairs = [(a, b) for a in range(3) for b in range(3) if a + b < 3]
    expected = sorted(((leg(a)[0] + leg(b)[0], leg(a)[1] * leg(b)[1]) for a, b in pairs), key=lambda x: x[0])
    order = np.argsort(paths.length[rows])
    assert paths.length[rows][order] == pytest.approx([x for x, _ in expected], abs=1e-9)
    found = paths.amplitude[rows][order]
    assert found / found[0] == pytest.approx([x / expected[0][1] for _, x in expected], abs=1e-6)


def test_a_point_behind_a_lorry_is_seen_over_a_wall_and_the_back_of_the_lorry() -> None:
    lorry = rc.Body(
        name="lorry",
        shape="box",
        params={"length": 2.0, "width": 2.0, "height": 3.0},
        position=(9.0, 2.0, -0.5),
        material="pec",
    )
    wall = rc.Body(
        name="wall",
        shape="plate",
        params={"width": 10.0, "height": 4.0},
        position=(16.0, 2.0, 1.0),
        yaw_deg=180.0,
        material="pec",
    )
    point = rc.Body("target", shape="sphere", params={"radius": 0.01}, position=(13.0, 2.4, 1.0), rcs_dbsm=10.0)
    wave = rc.Waveform(
        carrier=77e9, bandwidth=150e6, chirp_duration=30e-6, repetition=40e-6, n_chirps=16, n_samples=128
    )
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.IsotropicAntenna())
    model = {"max_bounces": 5, "tolerance_db": 1.0}
    paths = rc.simulate(rc.Scene(bodies=[lorry, wall, point], radar=radar, model=model)).paths
    row = np.flatnonzero((paths.bodies == "target").any(axis=1))
    # Mirrored at the wall the radar is at x = 32, and that at the lorry's back at x = -12.
    length = float(np.hypot(13.0 + 12.0, 2.4))
    assert paths.length[row] == pytest.approx([2.0 * length], abs=1e-9)
    level = 10.0 * (C0 / wave.middle) ** 2 / (4.0 * np.pi) ** 3 / length**4
    assert np.abs(paths.amplitude[row]) ** 2 == pytest.approx([level], rel=1e-3)


@pytest.mark.parametrize("rx", [None, (0.0, 0.2, 1.1)])
@pytest.mark.parametrize("turn_deg", [30.0, 50.0])
def test_a_large_plate_seen_over_a_wall_returns_as_its_image_behind_the_wall_would(
    turn_deg: float, rx: tuple[float, float, float] | None
) -> None:
    turn, far = np.radians(turn_deg), np.array([8.0, 0.0, 1.0])
    size, more = {"width": 1.0, "height": 0.8}, {"width": 3.0, "height": 2.0}
    # The wave comes along x, and leaves the wall turned by twice the angle between x and its normal.
    place = far + 4.0 * np.array([-np.cos(2.0 * turn), np.sin(2.0 * turn), 0.0])
    wave = rc.Waveform(carrier=24e9, bandwidth=150e6, chirp_duration=30e-6, n_chirps=16, n_samples=128)
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.IsotropicAntenna(), rx_position=rx)

    def amplitude(chain: str, *bodies: rc.Body) -> complex:
        scene = rc.Scene(bodies=list(bodies), radar=radar, model={"max_bounces": 3, "tolerance_db": 0.3})
        paths = rc.simulate(scene).paths
        names = np.array([">".join(x for x in row if x) for row in paths.bodies])
        return complex(paths.amplitude[names == chain].sum())

    wall = rc.Body("wall", shape="plate", params=more, position=far, yaw_deg=180.0 - turn_deg)
    plate = rc.Body("plate", shape="plate", params=size, position=place, yaw_deg=-2.0 * turn_deg)
    image = rc.Body("plate", shape="plate", params=size, position=(12.0, 0.0, 1.0), yaw_deg=180.0)
    assert amplitude("wall>plate>wall", wall, plate) == pytest.approx(amplitude("plate", image), rel=0.02)


@pytest.mark.parametrize("chain", ["plate>ground", "ground>plate"])
@pytest.mark.parametrize("width", [0.69, 0.73])
def test_a_plate_over_a_wall_and_the_ground_returns_as_its_image_over_the_ground_does(width: float, chain: str) -> None:
    """Just smaller than what counts as a mirror, and just larger; the ways over the wall alone are those above."""
    wave = rc.Waveform(carrier=24e9, bandwidth=150e6, chirp_duration=30e-6, n_chirps=16, n_samples=128)
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.IsotropicAntenna())
    ground = rc.Body("ground", shape="ground", params={"size": 80.0}, material="pec")

    def amplitude(chains: list[str], *bodies: rc.Body) -> complex:
        model = {"max_bounces": 4, "tolerance_db": 0.3}
        paths = rc.simulate(rc.Scene(bodies=[ground, *bodies], radar=radar, model=model)).paths
        names = np.array([">".join(x for x in row if x) for row in paths.bodies])
        return complex(paths.amplitude[np.isin(names, chains)].sum())

    size, up = {"width": width, "height": 0.7}, np.radians(-50.0)
    place = np.array([8.0 + 4.0 * np.cos(up + np.pi), 4.0 * np.sin(up + np.pi), 0.35])
    wall = rc.Body("wall", shape="plate", params={"width": 14.0, "height": 8.0}, position=(8, 0, 4), yaw_deg=155.0)
    plate = rc.Body("plate", shape="plate", params=size, position=place, yaw_deg=np.degrees(up))
    image = rc.Body("plate", shape="plate", params=size, position=(12.0, 0.0, 0.35), yaw_deg=180.0)
    # The wave meets the ground before the wall or behind it.
    near = {"plate>ground": "wall>plate>wall>ground", "ground>plate": "ground>wall>plate>wall"}[chain]
    both = amplitude([f"wall>{chain}>wall", near], wall, plate)
    assert both == pytest.approx(amplitude([chain], image), rel=0.03)


@pytest.mark.parametrize("count", [48, 49])
def test_faces_beyond_those_that_are_taken_as_mirrors_are_told(count: int) -> None:
    side = np.ceil(np.sqrt(count))
    walls = [
        rc.Body(f"wall_{i}", shape="plate", position=(10.0, 2.0 * (i % side), 2.0 * (i // side)), yaw_deg=180.0)
        for i in range(count)
    ]
    wave = rc.Waveform(carrier=24e9, bandwidth=150e6, chirp_duration=30e-6, n_chirps=16, n_samples=128)
    model = {"max_bounces": 2, "mode": "physical", "tolerance_db": 6.0, "max_rays": 1}
    scene = rc.Scene(bodies=walls, radar=rc.Radar(wave, antenna=rc.IsotropicAntenna()), model=model)
    found = rc.simulate(scene)
    assert (found.ledger["further mirrors"].kind == "seen") == (count > 48)
    assert any("further mirrors: 1 of 49" in line for line in found.warnings) == (count > 48)
