"""Which bodies turn, pass or move within a frame, and whether the frame needs more than one tracing for them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.waveform import OwnWaveform
from raychan.records import MIRROR
from raychan.world.body import Body
from raychan.world.errors import SceneError
from raychan.world.scene import Scene

_NEEDED = 1.0  # rad: phase error of constant rates over a frame above which `auto` uses keyframes
_PASSING = 1e-3
"""rad: phase error of constant rates between tracings above which bodies that pass are carried on. Where those of two
tracings meet, 0.05 rad made echoes that are none 70 dB below a plate's, 0.2 rad 40 dB, 0.5 rad 35 dB below."""
_SMEARED = 0.15
"""rad: phase error of constant rates over a frame from which on its one tracing is carried on for what passes. Of a
point it takes 0.009 dB away without a window, 0.002 dB with Hann's."""
_FARTHEST = 0.375  # of a frame of three tracings: how far one is carried on at most (see segments.reach)
_SLOWEST = 1e-9  # rad/s: a limb may stand still for a moment


def turning(scene: Scene) -> NDArray[np.bool_]:
    """Return which bodies (b,) turn."""
    return np.array([b.motion.turns for b in scene.bodies], bool)


def moving(scene: Scene) -> NDArray[np.bool_]:
    """Return which bodies (b,) turn or move relative to the radar."""
    own = np.asarray(scene.radar.velocity, float)
    return turning(scene) | np.array([not np.array_equal(b.motion.velocity, own) for b in scene.bodies], bool)


def moves_as_one(scene: Scene) -> bool:
    """Return whether all bodies and both ends of the radar move alike, so that its channel does not change."""
    return np.array_equal(scene.radar.rx_motion, scene.radar.velocity) and not moving(scene).any()


def carried_on(scene: Scene, retrace: str | int) -> NDArray[np.bool_]:
    """Return which bodies (b,) are extrapolated between tracings: those that turn or pass fast, or all that move."""
    return turning(scene) | passing(scene) if retrace == "auto" else moving(scene)


def passing(scene: Scene) -> NDArray[np.bool_]:
    """Return which bodies (b,) pass the radar so fast that constant rates do not hold from one tracing of a frame to
    where those of another take over: by the centripetal acceleration of their points. Targets that fluctuate are left
    to constant rates, and so are mirrors, which slide in their own plane."""
    return np.array([_passes(scene, body) and not body.fluctuates for body in scene.bodies], bool)


def passing_phases(scene: Scene) -> NDArray[np.float64]:
    """Return by how much phase (b,) [rad] constant rates are off half a frame from its middle, of bodies that pass."""
    return np.array([_phase_error(scene, body, 0.5) for body in scene.bodies], float)


def carried_over(scene: Scene, retrace: str | int, bent: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which bodies (b,) are carried on over a whole frame from its one tracing.

    Args: bent (b,) as of `passing_phases`."""
    steady = np.array([not body.fluctuates for body in scene.bodies], bool)
    follows = retrace == "auto" and scene.radar.waveform.n_chirps > 2 and not _refused(scene)
    return (bent > _SMEARED) & steady & follows


def unfollowed(
    scene: Scene, bent: NDArray[np.float64], carried: NDArray[np.bool_] | None, why: str = ""
) -> tuple[str, ...]:
    """Return a line if bodies pass so fast that constant rates do not hold over a frame, but are not carried on.

    Args: bent (b,) as of `passing_phases`; carried, which bodies (b,) are; why the others are not, unless the scene
    tells."""
    left = (bent > _SMEARED) if carried is None else (bent > _SMEARED) & ~carried
    if not left.any():
        return ()
    names = ", ".join(body.name for body, one in zip(scene.bodies, left, strict=True) if one)
    reason = why or (*_refused(scene), "targets that fluctuate")[0]
    return (
        f"{names}: passing bends ranges by up to {bent[left].max():.2g} rad of phase within the frame, and with "
        f"{reason} rates are constant: levels may be off by more than is stated",
    )


def fluctuating(scene: Scene) -> tuple[str, ...]:
    """Return the names of targets that pass so, but fluctuate."""
    return tuple(body.name for body in scene.bodies if body.fluctuates and _passes(scene, body))


def _passes(scene: Scene, body: Body) -> bool:
    """Return whether constant rates are too far off the ranges of a body's points between tracings of a frame."""
    return _phase_error(scene, body, _FARTHEST) > _PASSING


def _phase_error(scene: Scene, body: Body, share: float) -> float:
    """Return the phase error [rad] of constant rates over a share of a frame, of a body that moves evenly."""
    if body.resolved_role == MIRROR:
        return 0.0
    wave, own = scene.radar.waveform, np.asarray(scene.radar.velocity, float)
    bent = _centripetal(scene, body, np.asarray(body.motion.velocity, float) - own)
    return 2.0 * np.pi / wave.wavelength * bent * (share * wave.frame_duration) ** 2


def _centripetal(scene: Scene, body: Body, velocity: NDArray[np.float64]) -> float:
    """Return the greatest acceleration [m/s^2] of the range of a body's points at mid-frame, at an even velocity (3,)
    [m/s] relative to the radar."""
    if not velocity.any():
        return 0.0
    away = body.motion.to_world(body.geometry.vertices) - np.asarray(scene.radar.position, float)
    away = away + 0.5 * scene.radar.waveform.frame_duration * velocity
    distance = np.maximum(np.linalg.norm(away, axis=1), scene.radar.waveform.wavelength)
    across = float(velocity @ velocity) - (away @ velocity / distance) ** 2
    return float((across / distance).max(initial=0.0))


def bend(scene: Scene, edge: float) -> float:
    """Return the phase error [rad] of constant rates over a frame: at the outermost point of a turning body, by its
    centripetal acceleration, and across a tube of a given edge [m]."""
    wave, worst = scene.radar.waveform, 0.0
    k, half = 4.0 * np.pi / wave.wavelength, 0.5 * wave.frame_duration
    for body in (b for b, t in zip(scene.bodies, turning(scene), strict=True) if t):
        rate = max(float(np.linalg.norm(body.motion.spin())), _SLOWEST)
        vertices = body.geometry.vertices
        radius = float(
            np.linalg.norm(np.cross(body.motion.rotation().T @ body.motion.spin() / rate, vertices), axis=1).max()
        )
        size = float(np.ptp(vertices, axis=0).max())
        worst = max(worst, k * radius * (rate * half) ** 2 / 2.0, k * min(edge, size) * rate * half)
        worst = max(worst, k * body.motion.swerve(half))
    return worst


def needed(scene: Scene, retrace: str | int, edge: float) -> bool:
    """Return whether a frame needs more than one tracing: where bodies turn, also for what passes beside them."""
    if retrace == 1 or scene.radar.waveform.n_chirps < 3:
        return False
    if retrace != "auto":
        return bool(moving(scene).any())
    if bend(scene, edge) > _NEEDED:
        return True
    passes = turning(scene).any() and not _refused(scene)
    return bool(passes and max(_phase_error(scene, body, 0.5) for body in scene.bodies) > _NEEDED)


def middle_chirp(chirps: int) -> int:
    """Return the number of the chirp at whose start the middle tracing of several is made."""
    return (chirps - 1) // 2


def check_often(scene: Scene, retrace: str | int) -> None:
    """Raise SceneError for a scene whose frames are traced once only."""
    moves = "turn" if retrace == "auto" else "move or turn relative to the radar"
    for what in _refused(scene):
        problem = f"{retrace!r} given: with {what} a frame in which bodies {moves} is traced once"
        raise SceneError(problem, file=scene.path, key="model.retrace", value=retrace, allowed="1")


def _refused(scene: Scene) -> list[str]:
    """Return what of a scene lets its frames be traced once only."""
    radar = scene.radar
    refused = {
        "staggered repetition (radar.waveform.stagger_us)": bool(radar.waveform.stagger),
        'receivers of both polarisations (radar.rx_polarization = "both")': radar.rx_polarization == "both",
        "receivers elsewhere (radar.rx_position)": radar.rx_position is not None,
        "a waveform of one's own (a subclass of Waveform)": isinstance(radar.waveform, OwnWaveform),
    }
    return [name for name, given in refused.items() if given]
