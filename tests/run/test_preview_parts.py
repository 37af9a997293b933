"""Previews of what is seen in part, and of what turns: cylinders against closed forms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.run.preview import launch as preview_launch


def preview_of(*bodies: rc.Body, carrier: float, height: float, chirps: int, noise: bool = True) -> rc.Result:
    wave = rc.Waveform(
        carrier=carrier, bandwidth=300e6, chirp_duration=30e-6, repetition=80e-6, n_chirps=chirps, n_samples=64
    )
    radar = rc.Radar(wave, position=(0.0, 0.0, height), power=1.0, noise=noise)
    return rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"mode": "preview", "max_bounces": 1}), seed=0)


def rod(radius: float, height: float, **more: object) -> rc.Body:
    sizes = {"radius": radius, "height": height}
    return rc.Body("rod", shape="cylinder", params=sizes, material="metal", position=(6.0, 0.0, 0.0), **more)


def test_a_turning_rod_has_the_rate_of_the_foot_point_on_its_axis():
    """At a turn rate w the foot point, s from the pivot along the axis, comes or goes at w s."""
    turn, height, chirps = np.radians(150.0), 0.55, 128
    seen = preview_of(rod(0.06, 1.6, spin_dps=(0.0, 150.0, 0.0)), carrier=77e9, height=height, chirps=chirps)
    lean = turn * 0.5 * chirps * 80e-6  # in the middle of the frame
    foot = height * np.cos(lean) - 6.0 * np.sin(lean)
    strongest = np.argmax(seen.detections.power)
    cell = seen.scene.radar.channel_waveform.rate_resolution
    assert seen.detections.rate[strongest] == pytest.approx(turn * foot, abs=0.1 * cell)


@pytest.mark.parametrize(("carrier", "radius", "height"), [(24e9, 0.3, 2.3), (77e9, 0.06, 2.3), (77e9, 0.06, 3.0)])
def test_a_rod_hidden_up_to_its_foot_point_scatters_half_its_amplitude(carrier, radius, height):
    """The Fresnel integral over the half that is seen is half of that over all."""
    level = 0.8
    plate = {"width": 2.0, "height": 2.0}
    screen = rc.Body(
        "screen", shape="plate", params=plate, material="metal", position=(3.0, 0.0, level - 1.0), yaw_deg=180.0
    )
    powers = []
    for before in ([], [screen]):
        found = preview_of(rod(radius, height), *before, carrier=carrier, height=level, chirps=16).detections
        powers.append(found.power[np.abs(found.range - (6.0 - radius)) < 0.5].max())
    assert 10.0 * np.log10(powers[1] / powers[0]) == pytest.approx(20.0 * np.log10(0.5), abs=1.2)


def sheet(x: float, *rectangles: tuple[float, float, float, float]) -> trimesh.Trimesh:
    """Return rectangles (left, low, right, high) [m] of a sheet in the plane x that looks back; where corners meet they
    are one piece."""
    corners = [[[x, a, b], [x, a, d], [x, c, d], [x, c, b]] for a, b, c, d in rectangles]
    faces = [[4 * i + j for j in face] for i in range(len(rectangles)) for face in ([0, 1, 2], [0, 2, 3])]
    return trimesh.Trimesh(np.concatenate(corners), faces)


@pytest.mark.parametrize(("slats", "framed"), [(3, False), (24, False), (2, True)])
def test_a_plate_behind_slats_scatters_as_the_strips_of_it_that_are_seen(slats, framed):
    """Physical optics integrates over what is seen: the plate less the shadows of the slats, which are twice as wide
    and high; framed ones are one sheet with slots, and the strips end where its frame begins."""
    far, half = 8.0, 0.2
    top = 0.5 * half if framed else half
    edges = np.linspace(-half, half, 2 * slats + 1)
    columns = list(pairwise(edges))
    dark = [(a, -top, b, top) for a, b in columns[1::2]]
    for a, b in columns if framed else []:
        dark += [(a, top, b, 2.0 * half), (a, -2.0 * half, b, -top)]
    shadows = 0.5 * np.array(dark)
    behind = {"plate": sheet(far, (-half, -half, half, half)), "slats": sheet(0.5 * far, *shadows)}
    strips = {"strips": sheet(far, *[(a, -top, b, top) for a, b in columns[::2]])}
    powers = []
    for meshes in (behind, strips):
        bodies = [rc.Body(name, mesh=mesh, material="pec") for name, mesh in meshes.items()]
        found = preview_of(*bodies, carrier=24e9, height=0.0, chirps=16).detections
        powers.append(found.power[np.abs(found.range - far) < 0.5].max(initial=1e-300))
    assert 10.0 * np.log10(powers[0] / powers[1]) == pytest.approx(0.0, abs=0.3)


def test_without_noise_so_many_tubes_are_clipped_at_once_at_most(monkeypatch):
    """Without noise all tubes are strong: parts of parts would grow without end."""
    rows, clip = [], preview_launch.subdivide
    monkeypatch.setattr(preview_launch, "subdivide", lambda *x: (rows.append(len(x[3])), clip(*x))[1])
    slats = sheet(4.0, *[(a, -0.1, a + 0.01, 0.1) for a in np.arange(-0.1, 0.1, 0.02)])
    bodies = [rc.Body("plate", mesh=sheet(8.0, (-0.2, -0.2, 0.2, 0.2)), material="pec"), rc.Body("slats", mesh=slats)]
    most = []
    for limit in (2000, 1):
        monkeypatch.setattr(preview_launch, "_CLIPPED", limit)
        preview_of(*bodies, carrier=24e9, height=0.0, chirps=16, noise=False)
        most.append(max(rows))
        rows.clear()
    assert most[0] > 1 and most[1] == 1


@pytest.mark.parametrize(
    ("carrier", "height", "at", "turned", "eye", "looks"),
    [
        (77e9, 3.195997, (-1.161852, 1.215377), -97.187257, 1.07248, 103.776705),
        (24e9, 2.899668, (-1.326263, 1.578298), 19.865277, 0.515123, -162.685752),
    ],
)
def test_the_luminaire_a_range_cell_beyond_its_near_pole_is_found_at_its_level(carrier, height, at, turned, eye, looks):
    """The pole returns 26 dB more, of which little reaches so far beyond it."""
    wave = rc.Waveform(carrier=carrier, bandwidth=300e6, chirp_duration=40e-6, n_chirps=32, n_samples=128)
    form = {"height": height, "arm": 0.0}
    post = rc.Body("post", shape="lamp_post", params=form, position=(*at, 0.0), yaw_deg=turned)
    radar = rc.Radar(wave, position=(0.0, 0.0, eye), yaw_deg=looks, power=0.02)
    models = {"max_bounces": 1, "mode": "preview"}, {"max_bounces": 1, "tolerance_db": 0.3}
    seen, fine = (rc.simulate(rc.Scene(bodies=[post], radar=radar, model=model), seed=0) for model in models)
    (mine,), (its,) = ([i for i, p in enumerate(r.provenance) if p.bodies.endswith("luminaire")] for r in (seen, fine))
    assert fine.detections.snr[its] > 25.0
    off = abs(10.0 * np.log10(seen.detections.power[mine] / fine.detections.power[its]))
    assert off <= 3.0
