"""Checks of a whole scene: a radar inside a body, in the plane of a facet or within a wavelength of one, an array unfit
for its processing, targets beyond the unambiguous range or range rate."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from raychan.radar.aperture import Aperture
from raychan.radar.radar import Radar
from raychan.radar.waveform import MOST_FOLDS
from raychan.records import MIRROR
from raychan.units import C0
from raychan.world.body import Body
from raychan.world.errors import SceneError
from raychan.world.meshes.mesh import Floats
from raychan.world.point_in_body import Place, in_plane_of, nearest_on, place_of, within
from raychan.world.scene_files.schema import RadarTable

NEAREST = 0.01
"""Least distance [m] of a radar from a point target, or from another radar: nearer ones are at one place."""


def names_differ(bodies: Iterable[Body]) -> None:
    """Raise SceneError where two bodies have one name."""
    seen: set[str] = set()
    for body in bodies:
        if body.name in seen:
            raise SceneError(
                "two bodies have this name", key=f"bodies.{body.name}", allowed="a different name for each"
            )
        seen.add(body.name)


def radar_outside(bodies: Iterable[Body], radar: RadarTable | None) -> None:
    """Raise SceneError where the radar is inside a body, on its surface, at its point target, or below a mirror."""
    if radar is None:
        return
    bodies = tuple(bodies)
    outside(bodies, np.array(radar.position), "radar", "radar.position")
    if radar.rx_position is not None:
        outside(bodies, np.array(radar.rx_position), "receiver", "radar.rx_position")
        if radar.rx_position == radar.position:
            where = "a place apart from radar.position; without this key the receiver stands beside the transmitter"
            problem = "the receiver stands where the transmitter does"
            raise SceneError(problem, key="radar.rx_position", value=radar.rx_position, allowed=where)


def outside(bodies: Iterable[Body], at: Floats, what: str, key: str) -> None:
    """Raise SceneError where a place (3,) [m] is inside a body, on its surface, at its point target, or below a mirror.

    Args: what stands there, as messages call it; key that gives the place.
    """
    for body in bodies:
        local, mesh = body.motion.to_body(at), body.geometry
        if body.resolved_role == MIRROR:
            c = mesh.corners[0]
            n = np.cross(c[1] - c[0], c[2] - c[0])
            if n @ (local - c[0]) <= 0.0:
                where = "a place on its lit side"
                raise SceneError(f"{what} is behind '{body.name}'", key=key, value=at.tolist(), allowed=where)
            continue
        place = place_of(mesh.corners, local) if within(mesh.bounds, local) else Place.OUTSIDE
        if place != Place.OUTSIDE:
            where = "inside" if place == Place.INSIDE else "on the surface of"
            # A mesh in the wrong unit may enclose the radar.
            allowed = "; ".join(["a place outside all bodies", *(n for n in body.notes() if "check unit" in n)])
            problem = f"{what} is {where} '{body.name}'"
            raise SceneError(problem, key=key, value=at.tolist(), allowed=allowed)
        if body.rcs_dbsm is not None and np.linalg.norm(body.target_point() - local) < NEAREST:
            allowed = f"a place at least {NEAREST:g} m from its rcs_point"
            raise SceneError(
                f"{what} is at the point target of '{body.name}'", key=key, value=at.tolist(), allowed=allowed
            )


def radar_fits(radar: Radar, diffraction: bool) -> None:
    """Raise SceneError where the radar cannot have what is asked of it: diffraction to a receiver elsewhere, a chirp
    error that leaves no wave, or of its array ESPRIT, or a taper over its beams."""
    if diffraction and radar.rx_position is not None:
        problem = "diffraction is modelled for a receiver beside the transmitter only"
        raise SceneError(problem, key="model.diffraction", value=True, allowed="false with radar.rx_position")
    wave, error = radar.waveform, radar.impairments.chirp_error
    if error is not None and (lowest := error.lowest(wave.carrier, wave.slope, wave.chirp_duration)) <= 0.0:
        key, problem = "radar.impairments.chirp_error_us_khz", f"the ramp comes down to {lowest / 1e9:g} GHz"
        raise SceneError(problem, key=key, value=lowest, allowed="errors that leave it above 0 GHz")
    asked, aperture = radar.processing, Aperture(radar.virtual_elements, C0 / wave.middle)
    if asked.doa == "esprit" and not aperture.uniform:
        allowed = "bartlett, capon or music; esprit only with elements on a uniform line along y or z"
        raise SceneError("no uniform line of elements", key="processing.doa", value="esprit", allowed=allowed)
    if asked.beam_window != "rect" and aperture.table is None:
        allowed = "rect; a taper only over elements that fill a uniform line or rectangle"
        problem = "no uniform line or rectangle of elements"
        raise SceneError(problem, key="processing.beam_window", value=asked.beam_window, allowed=allowed)


def edge_on(bodies: Iterable[Body], radar: RadarTable) -> list[str]:
    """Return a warning for each body that has facets in whose plane the radar lies."""
    said = []
    for body in bodies:
        at = body.motion.to_body(np.array(radar.position))
        count = in_plane_of(body.geometry.planes_near(at), at)
        if count:
            said.append(f"radar lies in the plane of {count} facets of '{body.name}': edge-on, they return nothing")
    return said


def too_near(bodies: Iterable[Body], radar: Radar) -> list[str]:
    """Return a warning for each body within a wavelength of an end of the radar: rays carry no near fields."""
    said, wavelength = [], C0 / radar.waveform.middle
    ends = {"radar": radar.position} | ({} if radar.rx_position is None else {"receiver": radar.rx_position})
    for body in bodies:
        if body.resolved_role == MIRROR or body.rcs_dbsm is not None:
            continue
        for what, at in ends.items():
            local = body.motion.to_body(np.asarray(at, float))
            if not within(body.geometry.bounds + np.array([[-wavelength], [wavelength]]), local):
                continue
            away = float(np.linalg.norm(nearest_point(body, np.asarray(at, float)) - at))
            if away < wavelength:
                said.append(
                    f"{what} is {1e3 * away:.2g} mm from '{body.name}', less than a wavelength "
                    f"({1e3 * wavelength:.2g} mm): its level leaves out near fields, and errs beyond what is stated"
                )
    return said


def nearest_point(body: Body, at: Floats) -> Floats:
    """Return the point of a body's facets (world, (3,)) that is nearest to a point (3,)."""
    return np.asarray(body.motion.to_world(nearest_on(body.geometry.corners, body.motion.to_body(at))))


def aliases(bodies: Iterable[Body], radar: Radar) -> list[str]:
    """Return a warning for each body beyond the unambiguous range or range rate, with the value at which it appears."""
    said = []
    at, own, waveform = radar.position, radar.velocity, radar.waveform
    limit, top = waveform.unambiguous_range, radar.resolved_rate * waveform.carrier / waveform.middle
    # Where not all folds are tested, what lies beyond the last one looks like none of them.
    known = waveform.fold_count < MOST_FOLDS
    for body in bodies:
        if body.resolved_role == MIRROR or _near_and_slow(body, at, own, limit, top):
            continue
        place = nearest_point(body, at) if body.rcs_dbsm is None else body.motion.to_world(body.target_point())
        way = place - at
        far = float(np.linalg.norm(way))
        rate = float((body.motion.velocity_at(place) - own) @ way / far) if far > 0.0 else 0.0
        if far > limit:
            seen = folded_range(far, limit, waveform.complex_sampling)
            said.append(
                f"body '{body.name}' at {far:.2f} m is beyond the unambiguous range {limit:.2f} m: "
                f"it appears near {seen:.0f} m"
            )
        if abs(rate) > top:
            seen = (rate + top) % (2.0 * top) - top
            said.append(
                f"body '{body.name}' at {rate:.2f} m/s is beyond the unambiguous range rate {top:.2f} m/s: "
                + (f"it appears near {seen:.1f} m/s" if known else "it appears at another rate")
            )
    return said


def _near_and_slow(body: Body, at: Floats, own: Floats, limit: float, top: float) -> bool:
    """Return whether all points of a body are within `limit` [m] of a radar and slower than `top` [m/s] towards it."""
    low, high = body.geometry.bounds
    places = [low, high] if body.rcs_dbsm is None else [low, high, body.target_point()]
    middle = 0.5 * (low + high)
    radius = max(float(np.linalg.norm(p - middle)) for p in places)
    way = body.motion.to_world(middle) - at
    arm = float(np.linalg.norm(middle)) + radius
    speed = float(np.linalg.norm(np.asarray(body.motion.velocity) - own) + np.linalg.norm(body.motion.spin()) * arm)
    return float(np.linalg.norm(way)) + radius < limit and speed < top


def folded_range(distance: float, limit: float, complex_sampling: bool) -> float:
    """Return the range [m] at which a target beyond the unambiguous range `limit` [m] appears."""
    if complex_sampling:
        return distance % limit
    rest = distance % (2.0 * limit)
    return min(rest, 2.0 * limit - rest)
