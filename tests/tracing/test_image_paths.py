"""What a leg over mirrors may reach: no sphere is left out to which a ray comes, few are kept to which none does."""

import numpy as np
import pytest

import raychan as rc
from raychan.tracing.image_paths import bounds_of_light, may_reach
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import Mirror

_POINTS = 4000  # in each sphere, half of them on its surface
_INSIDE = np.random.default_rng(0).dirichlet(np.ones(3), _POINTS)  # of a triangle, by its corners


def chain_of(rng: np.random.Generator, count: int):
    """Return an end's images, and point and normal of so many mirrors, each in front of the image before it, and the
    rectangles that they are."""
    images, at, normal, low, high, axes = [rng.normal(0.0, 1.0, 3)], [], [], [], [], []
    for _ in range(count):
        n = rng.normal(0.0, 1.0, 3)
        n /= np.linalg.norm(n)
        # Grazing as often as not.
        height = rng.choice([0.05, 0.3, 3.0]) * rng.uniform(0.5, 1.5)
        u = np.cross(n, rng.normal(0.0, 1.0, 3))
        u /= np.linalg.norm(u)
        axes.append(np.array([u, np.cross(n, u)]))
        at.append(images[-1] - height * n + u * rng.uniform(0.5, 8.0))
        normal.append(n)
        half = rng.uniform(0.1, 3.0, 2)
        low.append(axes[-1] @ at[-1] - half)
        high.append(axes[-1] @ at[-1] + half)
        images.append(images[-1] - 2.0 * height * n)
    return tuple(np.array(x) for x in (images, at, normal, low, high, axes))


def circles(chain):
    """Return the chain with the circles about its mirrors in place of the rectangles."""
    *begin, low, high, _ = chain
    return *begin, chain[1], np.linalg.norm(0.5 * (high - low), axis=1)


def leg_of(chain):
    """Return the leg over the mirrors of a chain."""
    images, at, normal, low, high, axes = chain
    mirrors = [Mirror(at[i], normal[i], 0, 0, at[i], 1.0, low[i], high[i], axes[i]) for i in range(len(at))]
    return Leg(end=images[0], mirrors=tuple(mirrors))


def come(points, images, at, normal, low, high, axes):
    """Tell to which points (n, 3) a ray comes, over one mirror after the other, by plain vectors."""
    x, ok = points, np.ones(len(points), bool)
    for i in range(len(at) - 1, -1, -1):
        height, depth = (x - at[i]) @ normal[i], (at[i] - images[i + 1]) @ normal[i]
        ok &= (height > 0.0) & (depth > 0.0)
        t = depth / np.where(ok, height + depth, 1.0)
        x = images[i + 1] + t[:, None] * (x - images[i + 1])
        on = x @ axes[i].T
        ok &= ((on > low[i]) & (on < high[i])).all(axis=1)
    return ok


def spheres(rng: np.random.Generator):
    """Give chains of one to three mirrors, a sphere, and points in it."""
    for k in range(1500):
        chain = chain_of(rng, 1 + k % 3)
        size = rng.choice([0.02, 0.3, 2.0])
        # About a point that a ray reaches, or beside it.
        last, n, half = chain[1][-1], chain[2][-1], 0.5 * (chain[4][-1] - chain[3][-1])
        ray = last + (rng.uniform(-1.0, 1.0, 2) * half) @ chain[5][-1] - chain[0][-1]
        centre = chain[0][-1] + ray * rng.uniform(1.05, 4.0) + rng.normal(0.0, 1.0, 3) * size
        centre += n * max(0.0, -((centre - last) @ n) - size)
        points = rng.normal(0.0, 1.0, (_POINTS, 3))
        points /= np.linalg.norm(points, axis=1)[:, None]
        points[::2] *= rng.uniform(0.0, 1.0, (len(points[::2]), 1))
        yield chain, centre, size, centre + size * points


def sphere_kept(chain, centre, size, points):
    """Return where rays to a sphere may come to, and whether it is kept."""
    return points, may_reach(centre[None], np.array([size]), *circles(chain))[0]


def triangle_kept(chain, centre, size, points):
    """Return where rays to a triangle in a sphere may come to, and whether it is kept."""
    corners = points[1:6:2]
    return _INSIDE @ corners, leg_of(chain).may_leave(corners[None])[0]


# What is kept in vain only costs rays.
@pytest.mark.parametrize(("kept", "in_vain"), [(sphere_kept, 3.0), (triangle_kept, 0.2)])
def test_nothing_is_left_out_to_which_a_ray_comes(kept, in_vain):
    reached = said = 0
    for chain, *ball in spheres(np.random.default_rng(5)):
        points, keep = kept(chain, *ball)
        truth = bool(come(points, *chain).any())
        assert keep or not truth
        reached += truth
        said += bool(keep)
    assert reached > 50
    assert said < (1.0 + in_vain) * reached


def test_all_rays_over_mirrors_run_between_the_sides_of_their_windows():
    reached = 0
    for chain, _, _, points in spheres(np.random.default_rng(7)):
        at, leg = chain[1], leg_of(chain)
        assert np.allclose(leg.image, chain[0][-1])
        lit = points[come(points, *chain)]
        side = (lit - leg.image) @ leg.windows.T
        assert len(leg.windows) == 4 * len(at)
        assert (side > 0.0).all()
        reached += len(lit) > 0
        # A triangle of which some is lit and some is not is clipped.
        corners = points[None, 1:6:2]
        cut, some = np.zeros((1, 3)), come(_INSIDE @ corners[0], *chain)
        bounds_of_light(corners, np.arange(1), *leg.edges_of_mirrors, cut)
        if cut.any():
            assert cut.min() < 0.0 < cut.max()
        elif leg.may_leave(corners)[0] and len(at) == 1:
            assert some.all()
    assert reached > 100


def box(name, x, y, z):
    """Return a conducting box between two bounds along each axis."""
    shape = {"length": x[1] - x[0], "width": y[1] - y[0], "height": z[1] - z[0]}
    middle = ((x[0] + x[1]) / 2, (y[0] + y[1]) / 2, z[0])
    return rc.Body(name=name, shape="box", params=shape, position=middle, material="pec")


@pytest.mark.parametrize("height", [0.7, 2.0])
def test_a_post_on_a_roof_returns_as_much_in_one_piece_as_in_two(height):
    """The roof, seen at a grazing angle, lights the lowest decimetres of the post only."""
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=8, n_samples=64)
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.5), noise=False, power=1.0)
    roof, side = box("roof", (7.0, 9.0), (-1.0, 1.0), (0.0, 0.5)), ((7.92, 8.08), (-0.08, 0.08))
    posts = [[("post", 0.5, 0.5 + height)], [("low", 0.5, 0.7), ("high", 0.7, 0.5 + height)]]
    level, error = [], []
    for parts in posts:
        bodies = [roof, *(box(name, *side, (low, high)) for name, low, high in parts)]
        found = rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2, "tolerance_db": 0.5}))
        strongest = int(np.argmax(found.detections.power))
        level.append(10.0 * np.log10(found.detections.power[strongest]))
        error.append(found.detections.error_db[strongest])
    assert abs(level[0] - level[1]) < error[0] + error[1]


@pytest.mark.parametrize("depth", [0.01, 0.435])
def test_a_pole_returns_as_much_through_a_roof_as_standing_on_it(depth):
    """All rays to the corners and centres of its long facets miss what the roof lights of them."""
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=8, n_samples=64)
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.5), noise=False, power=1.0)
    roof, side = box("roof", (4.3, 5.7), (-0.6, 0.6), (0.0, 0.9)), ((4.94, 5.06), (-0.06, 0.06))
    level, error = [], []
    for low in (0.9, 0.9 - depth):
        bodies = [roof, box("pole", *side, (low, 1.7))]
        found = rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2, "tolerance_db": 0.5}))
        strongest = int(np.argmax(found.detections.power))
        level.append(10.0 * np.log10(found.detections.power[strongest]))
        error.append(found.detections.error_db[strongest])
    assert abs(level[0] - level[1]) < error[0] + error[1]
