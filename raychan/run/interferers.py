"""What the interferers of a scene add to the samples of its radar."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from raychan.channel.drifts import drifts
from raychan.channel.ends import rx_fields
from raychan.channel.paths import over_routes
from raychan.channel.rates import rates
from raychan.channel.transfer import transfer
from raychan.radar.interferer import Interferer
from raychan.records import Paths
from raychan.run.specular_paths import Chain, exact_routes
from raychan.run.streams import Stage, stream
from raychan.signal.interference import burst
from raychan.tracing.legs import legs_over
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.scene import Scene

Sent = Mapping[str, NDArray[np.complex128]]
"""What interferers, by name, add to the samples (a, c, s) [sqrt(W)]."""

_BOUNCES = 1  # mirrors on the way: each further one loses several dB against the direct way; not measured


def interference(scene: Scene, geometry: Geometry, seed: int) -> Sent:
    """Return what each interferer of a scene, by name, adds to the samples (a, c, s) [sqrt(W)], with phases of the
    stream of its name."""
    return {
        one.name: burst(
            scene.radar, one, interferer_paths(scene, geometry, one), stream(seed, Stage.INTERFERENCE, one.name)
        )
        for one in scene.interferers
    }


def never_heard(scene: Scene) -> list[str]:
    """Return a line for each interferer whose ramps all arrive before or after those of the scene's radar."""
    said, victim = [], scene.radar
    for one in scene.interferers:
        wave = one.radar.waveform
        late = float(np.linalg.norm(one.radar.position - victim.rx_place)) / C0
        begin, frame = one.start + late, victim.waveform.frame_duration
        end = begin + wave.frame_duration
        if begin >= frame or end <= 0.0:
            when = f"arrive from {begin:.4g} s on" if begin > 0.0 else f"have arrived by {end:.4g} s"
            key = f"interferers.{one.name}.start_us, waveform.chirps"
            said.append(
                f"interferer '{one.name}' is not heard: its ramps {when}, the frame lasts {frame:.4g} s ({key})"
            )
    return said


def interferer_paths(scene: Scene, geometry: Geometry, interferer: Interferer) -> Paths:
    """Return the paths from an interferer to the receivers of the scene's radar: straight, and over one plane mirror of
    half a square metre or more, both antennas in, with gains of the middle of the interferer's ramp and phases of its
    carrier."""
    sender, victim, facets = interferer.radar, scene.radar, geometry.facets
    chains: list[Chain] = []
    for leg in legs_over(geometry, np.asarray(sender.position), _BOUNCES):
        sides = [1 if m.normal @ geometry.normal[m.facet] > 0.0 else -1 for m in leg.mirrors]
        chains.append(tuple((m.facet, side) for m, side in zip(leg.mirrors, sides, strict=True)))
    layers = scene.model.max_transmissions
    routes = exact_routes(geometry, sender.position, victim.rx_place, chains, _BOUNCES + layers, layers)
    ends = rx_fields(victim)
    gains = transfer(
        routes,
        facets,
        sender.waveform.middle,
        lambda d: np.asarray(sender.tx_field(d))[:, None],
        lambda d: np.stack([np.asarray(f(d)) for f in ends], axis=1),
    )[:, :, 0]
    gains *= np.exp(2j * np.pi * sender.waveform.swept / C0 * routes.length)[:, None]
    return over_routes(
        routes,
        facets,
        victim,
        drifts(routes, facets, victim, np.asarray(sender.velocity), np.asarray(victim.rx_motion)),
        length=routes.length,
        length_rate=2.0 * rates(routes, facets, sender.velocity, victim.rx_motion),
        **dict(zip(("amplitude", "cross"), gains.T, strict=False)),
        trajectory=np.arange(len(gains), dtype=np.int32),
    )
