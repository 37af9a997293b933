"""Rays cast by compiled code meet what the slow way around embreex meets, and Embree is called as it wants to be."""

from __future__ import annotations

import gc
from importlib import metadata
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from support.facets import ball, box, facets, ground, quad
from truth.embree_rays import SlowCaster

from raychan import parallel
from raychan.geometry import embree_packet
from raychan.geometry.embree_packet import END, LANES, RECORD_END, own_packet, put_ray
from raychan.records import LAYER, PEC
from raychan.world import embree_library
from raychan.world.embree_library import EmbreeScene, NoEmbree, intersect_address
from raychan.world.ray_caster import RayCaster

NONE = np.int32(-1)


def street():
    """Return boxes, one upon the other, a sphere, an upright sheet and the ground."""
    sheet = quad([[6, -3, 0], [6, -1, 0], [6, -1, 2], [6, -3, 2]])
    lower, upper = box((3, 0, 0), (5, 2, 1)), box((3.2, 0.2, 1), (4.8, 1.8, 2.2))
    return facets([ground(40.0), lower, upper, ball((8.0, 2.0, 0.9), 0.7), sheet])


def rays(f, n, seed):
    """Return rays of all kinds: a third at places anywhere, at corners, at places on edges; some leave a facet, some
    start to count farther on."""
    rng = np.random.default_rng(seed)
    v, which = f.vertices, rng.integers(len(f.vertices), size=n)
    a, b = v[which, 0], v[which, 1]
    aims = rng.uniform((0, -4, 0), (10, 4, 3), (n, 3)), a, a + rng.uniform(size=(n, 1)) * (b - a)
    aim = np.choose(rng.integers(3, size=n)[:, None], aims)
    origin = rng.uniform((-5, -6, 0.2), (12, 6, 4), (n, 3))
    skip = np.where(rng.uniform(size=n) < 0.3, rng.integers(len(v), size=n), NONE).astype(np.int32)
    origin[skip >= 0] = v[skip[skip >= 0]].mean(axis=1)
    direction = aim - origin
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return origin, direction, skip, np.where(rng.uniform(size=n) < 0.3, rng.uniform(0.0, 5.0, n), 0.0)


@pytest.mark.parametrize("seed", range(3))
def test_rays_meet_the_facets_that_the_slow_way_meets(seed):
    f = street()
    # At the points of the compass too, and from far off.
    lots = [rays(f, 2000, seed), rays(f, 200, seed + 10)]
    lots[1][0][:] -= 5000.0 * lots[1][1]
    for lot in lots:
        facet, distance = RayCaster(f).cast(*lot)
        wanted, at = SlowCaster(f.vertices).cast(*lot)
        assert (wanted >= 0).mean() > 0.3
        # Where facets meet, either may be named.
        differ = facet != wanted
        assert differ.sum() <= 2
        np.testing.assert_allclose(distance[~differ], at[~differ], rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(distance[differ], at[differ], atol=1e-4)


def test_a_shadow_ray_passes_layer_after_layer_as_cast_after_cast_says():
    # The third covers one half.
    panes = [quad([[x, y, -2], [x, 2, -2], [x, 2, 2], [x, y, 2]]) for x, y in ((1.0, -2), (2.0, -2), (3.0, 0))]
    rows = [(LAYER, 6.0 + 0j, 0.004, 0.0)] * 3 + [(PEC, 1.0 + 0j, 0.0, 0.0)]
    tracer = RayCaster(facets([*panes, box((4, -1, -1), (5, 1, 1))], rows))
    rng = np.random.default_rng(5)
    n = 500
    aim = rng.uniform((4.0, -2.5, -2.5), (6.0, 2.5, 2.5), (n, 3))
    limit = np.linalg.norm(aim, axis=1)
    d, none = aim / limit[:, None], np.full(n, NONE)
    for layers in (0, 2, 3):
        reached, passed, blocker = tracer.walk(np.zeros((n, 3)), d, limit, np.full(n, 1e-5), none, none, layers)
        start, left = np.zeros(n), np.arange(n)
        seen, through, in_way = np.zeros(n, bool), np.full((n, layers), NONE), np.full(n, NONE)
        for turn in range(layers + 1):
            facet, t = tracer.cast(np.zeros((len(left), 3)), d[left], none[left], start[left])
            free = (facet < 0) | (t >= limit[left] - 1e-5)
            seen[left[free]], in_way[left] = True, np.where(free, NONE, facet)
            on = ~free & (facet < 6) & (turn < layers)
            left = left[on]
            start[left] = t[on] + tracer._nearest
            if turn < layers:
                through[left, turn] = facet[on]
        np.testing.assert_array_equal(reached, seen)
        np.testing.assert_array_equal(passed, through)
        np.testing.assert_array_equal(blocker, in_way)
        assert reached.sum() == 0 if layers == 0 else 0 < reached.sum() < n


def test_any_number_of_threads_finds_the_same_bytes_and_counts_the_same_rays():
    f = street()
    lot = rays(f, 40_000, 7)
    found = []
    try:
        for threads in (1, 2, 3, 8):
            parallel.set_threads(threads)
            tracer = RayCaster(f)
            facet, distance = tracer.cast(*lot)
            seen = tracer.walk(*lot[:2], np.full(40_000, 4.0), np.full(40_000, 1e-5), lot[2], np.full(40_000, NONE), 1)
            found.append([x.tobytes() for x in (facet, distance, *seen)] + [tracer.rays])
    finally:
        parallel.set_threads(None)
    assert all(other == found[0] for other in found)


def test_the_packet_is_embrees_record_and_nothing_is_written_beyond_it():
    floats, words = own_packet()
    assert words.ctypes.data % 64 == 0
    assert floats.ctypes.data == words.ctypes.data
    assert words.nbytes == floats.nbytes == 4 * END
    # RTCRayHit4: 12 columns of the ray, 9 of the hit with the numbers of an instance and of its part, aligned to 16.
    assert RECORD_END == (12 + 9) * LANES
    assert 4 * RECORD_END % 16 == 4 * embree_packet.VALID % 16 == 4 * embree_packet.ARGUMENTS % 64 == 0
    scene = EmbreeScene(np.ascontiguousarray(ball((0, 0, 0), 1.0).triangles, np.float32))
    put = getattr(put_ray, "py_func", put_ray)
    for lane in range(3):
        put(floats, words, lane, -3.0, 0.01 * lane, 0.02, (1.0, 0.0, 0.0))
    words[RECORD_END : embree_packet.VALID] = 12345
    words[embree_packet.PRIMITIVE + 3] = 777
    beyond, unused = words[RECORD_END:].copy(), words[embree_packet.PRIMITIVE + 3]
    named = getattr(embree_packet.first_triangles, "py_func", embree_packet.first_triangles)
    hit = named(intersect_address(), scene.address, words)
    assert min(hit) >= 0
    centres = ball((0, 0, 0), 1.0).triangles[list(hit)].mean(axis=1)
    assert (np.linalg.norm(centres - (-1.0, 0.0, 0.0), axis=1) < 0.1).all()
    np.testing.assert_array_equal(words[RECORD_END:], beyond)
    assert words[embree_packet.PRIMITIVE + 3] == unused


def test_a_scene_ends_with_its_object(monkeypatch):
    ended = []
    library = embree_library.library()
    monkeypatch.setattr(library, "rtcReleaseScene", ended.append)
    scene = EmbreeScene(np.zeros((1, 3, 3), np.float32))
    address = int(scene.address)
    del scene
    gc.collect()
    assert ended == [address]


@pytest.fixture
def fresh():
    """Let the library be looked for anew, and found again afterwards."""
    kept = embree_library.library(), embree_library._device()
    for found in (embree_library.library, embree_library._device):
        found.cache_clear()
    yield kept
    for found in (embree_library.library, embree_library._device):
        found.cache_clear()


def test_a_library_that_is_not_there_is_named(fresh, monkeypatch):
    other = SimpleNamespace(version="2.17.7", files=[SimpleNamespace(name="libembree.so.2")])
    monkeypatch.setattr(embree_library, "distribution", lambda name: other)
    with pytest.raises(NoEmbree, match=r"embreex 2\.17\.7 ships no library of Embree 4"):
        RayCaster(street()).cast(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), np.array([NONE]))

    def missing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(embree_library, "distribution", missing)
    with pytest.raises(NoEmbree, match="embreex, which ships Embree 4, is not installed"):
        EmbreeScene(np.zeros((1, 3, 3), np.float32))


def test_a_library_that_cannot_be_loaded_is_named(fresh, monkeypatch, tmp_path):
    file = tmp_path / "libembree4.so.4"
    file.write_bytes(b"no library")
    other = SimpleNamespace(version="9.9", files=[file], locate_file=lambda f: f)
    monkeypatch.setattr(embree_library, "distribution", lambda name: other)
    with pytest.raises(NoEmbree, match=r"libembree4\.so\.4 of embreex 9\.9 is not Embree 4 or cannot be loaded"):
        embree_library.library()


def test_another_version_is_named(fresh, monkeypatch):
    library = embree_library.library()
    monkeypatch.setattr(library, "rtcGetDeviceProperty", lambda device, which: 31_302)
    with pytest.raises(NoEmbree, match=r"is Embree 3\.13\.2; compiled code calls Embree 4"):
        EmbreeScene(np.zeros((1, 3, 3), np.float32))


def test_no_facets_are_no_hits():
    empty = street().replace(
        **{k: getattr(street(), k)[:0] for k in ("vertices", "normals", "body", "part", "material")}
    )
    tracer = RayCaster(empty)
    facet, distance = tracer.cast(np.zeros((2, 3)), np.eye(3)[:2], np.full(2, NONE))
    assert (facet == -1).all() and np.isinf(distance).all()
    reached, _, _ = tracer.walk(np.zeros((2, 3)), np.eye(3)[:2], np.ones(2), np.ones(2), *[np.full(2, NONE)] * 2, 0)
    assert reached.all()


def test_a_large_mesh_is_built_for_all_its_triangles():
    mesh = trimesh.creation.icosphere(6, 1.0)
    tracer = RayCaster(facets([mesh]))
    middle = mesh.triangles.mean(axis=1)
    way = -middle / np.linalg.norm(middle, axis=1)[:, None]
    facet, _ = tracer.cast(middle - 2.0 * way, way, np.full(len(middle), NONE))
    np.testing.assert_array_equal(facet, np.arange(len(middle)))
