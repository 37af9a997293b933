"""Targets whose given RCS fluctuates (Swerling 1 to 4): one draw a frame or a chirp, put upon the samples of a frame.

The RCS is drawn, the phase stays that of the path. Over a frame, case 2 or 4 then adds up to the mean of its amplitudes
(1.05 and 0.54 dB under the mean RCS over many chirps), and the rest spreads over all range rates.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.processing.detection_theory import fluctuation
from raychan.radar.dual_paths import scaled
from raychan.records import POINT, Cube, Paths
from raychan.run.path_stream import Launched
from raychan.run.streams import Stage, stream
from raychan.signal.baseband import synthesize
from raychan.signal.delay_profile import response
from raychan.world.errors import SceneError
from raychan.world.scene import Scene

Floats = NDArray[np.float64]


def check(scene: Scene, turned: NDArray[np.bool_]) -> None:
    """Raise SceneError where a fluctuating target is among the bodies (b,) that are carried on between tracings."""
    for body, turns in zip(scene.bodies, turned, strict=True):
        if body.fluctuates and turns:
            key, allowed = f"bodies.{body.name}.swerling", "0 on a body that turns or moves, or model.retrace = 1"
            raise SceneError("a frame traced more than once", key=key, value=body.swerling, allowed=allowed)


def drawn(scene: Scene, chirps: int, seed: int) -> dict[int, Floats]:
    """Return the amplitude factors (chirps,) of each fluctuating body by its number, each of the stream of its name."""
    return {
        b: np.sqrt(fluctuation(body.swerling, chirps, 1, stream(seed, Stage.FLUCTUATION, body.name))[0])
        for b, body in enumerate(scene.bodies)
        if body.fluctuates
    }


def fluctuated(quiet: Cube, launched: Launched, factors: dict[int, Floats]) -> tuple[Cube, Launched]:
    """Return samples and launch of a frame whose targets fluctuate by factors (chirps,) on their amplitudes.

    Paths and profile get the mean factor of the frame. Of a launch with more paths than are kept only those kept
    fluctuate: they are its strongest.
    """
    if not factors:
        return quiet, launched
    paths, radar = launched.paths, launched.radar
    samples, profile = quiet.samples.astype(np.complex128), launched.response
    scale = np.ones(len(paths.delay))
    for body, factor in factors.items():
        mine = of_target(paths, body)
        own: Paths = take(paths, mine)
        samples += (factor - 1.0)[:, None] * synthesize(own, radar).samples
        profile = profile + (factor.mean() - 1.0) * response(own, radar.waveform, radar.power, launched.window)
        scale[mine] = factor.mean()
    cube = Cube(samples=samples.astype(np.complex64), noise_power=quiet.noise_power)
    return cube, replace(launched, paths=scaled(paths, scale), sums=(cube.samples, profile))


def of_target(paths: Paths, body: int) -> NDArray[np.bool_]:
    """Return which paths (n,) are scattered by a body that is given by its RCS."""
    met = paths.trajectories
    return np.asarray(((met.body == body) & (met.kind == POINT)).any(axis=1))[paths.trajectory]
