"""One draw of what is random in a channel before the receiver: targets that fluctuate, and clutter."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from raychan.channel.paths import join
from raychan.records import Cube
from raychan.run.clutter import clutter_of
from raychan.run.fluctuation import drawn, fluctuated
from raychan.run.path_stream import Launched
from raychan.run.streams import Stage, stream
from raychan.signal.baseband import synthesize
from raychan.signal.delay_profile import response
from raychan.world.geometry import Geometry
from raychan.world.scene import Scene


def realized(
    scene: Scene, geometry: Geometry, model: Any, quiet: Cube, launched: Launched, seed: int
) -> tuple[Cube, Launched]:
    """Return the samples without noise and the launch of one draw.

    Args: scene and geometry at the instant of the tracing; model, what is modelled; quiet and launched, of steady
    targets without clutter; seed of the run.
    """
    radar = scene.radar
    factors = drawn(scene, radar.waveform.n_chirps, seed)
    quiet, launched = fluctuated(quiet, launched, factors)
    clutter, said = clutter_of(geometry, radar, model, stream(seed, Stage.CLUTTER))
    count = len(clutter.delay)
    if not count:
        return quiet, launched
    samples = (quiet.samples + synthesize(clutter, launched.radar).samples).astype(np.complex64)
    profile = launched.response + response(clutter, radar.waveform, radar.power, launched.window)
    paths = join([launched.paths, clutter])
    found = replace(launched, paths=paths, count=launched.count + count, sums=(samples, profile), said=said)
    return Cube(samples=samples, noise_power=0.0), found
