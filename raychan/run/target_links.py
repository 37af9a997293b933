"""The link budget of targets given by their RCS: SNR in a map cell and probability of detection, without tracing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from raychan.processing.cfar import GUARD, TRAIN, Grid, fitting_guard, training
from raychan.processing.detection_theory import Detector, detection_probability
from raychan.radar.radar import Radar
from raychan.run.receiver import looks_of, noise_of_beam
from raychan.tracing.point_targets import bistatic_sigma
from raychan.units import C0, db
from raychan.world.scene import Scene

_COHERENT_DB = (0.0, 0.0, -1.049, 0.0, -0.537)
"""Power of the mean amplitude over the mean power [dB] by Swerling case: what stays of chirps summed in phase where the
RCS is drawn anew for each; of exponential RCS pi / 4, of chi-square of four degrees 9 pi / 32."""


@dataclass(frozen=True)
class TargetLink:
    """A target given by its RCS over the direct path, nothing in between: `name`, `range` [m], `rcs` [dBsm] towards the
    radar, `snr` [dB] of its peak in the map, or in the beam towards it, on average, Swerling case, `probability` of
    detection in one frame."""

    name: str
    range: float
    rcs: float
    snr: float
    swerling: int
    probability: float


def detector_of(radar: Radar) -> Detector | None:
    """Return the detector of a radar's map; None where its map is too small for a CFAR."""
    wave, settings = radar.channel_waveform, radar.processing
    counts = wave.n_chirps, wave.n_samples // (1 if wave.complex_sampling else 2)
    wanted, cells = ((pair[::-1] if pair else None) for pair in (settings.guard, settings.train))
    guard = fitting_guard(counts, wanted or GUARD, cells or TRAIN)
    if guard is None:
        return None
    windows = settings.rate_window, settings.range_window
    ring = training(Grid(settings.pad[::-1], counts), guard, cells or TRAIN, windows)
    looks, pfa = looks_of(radar, settings)
    return Detector(pfa, looks, settings.cfar, ring.worth, settings.min_snr_db)


def target_links(scene: Scene) -> tuple[TargetLink, ...]:
    """Return the link of each target given by its RCS; none where noise is off or the map too small for a CFAR.

    Source: radar equation, Skolnik 2008 (eq. 1.6), antennas and windows as they are. Case 2 and 4 add up in phase
    within a frame: to a steady target of the mean amplitude.
    """
    radar, points = scene.radar, scene.points(0.0)
    detector, noise = detector_of(radar), noise_of_beam(radar, radar.processing)
    if detector is None or noise == 0.0:
        return ()
    noise *= 1.0 if radar.waveform.complex_sampling else 2.0
    found = []
    for p, b in enumerate(points.body):
        there, back = points.position[p] - radar.position, points.position[p] - radar.rx_place
        near, far = float(np.linalg.norm(there)), float(np.linalg.norm(back))
        sent, look = there[None] / near, back[None] / far
        gain = float(np.abs(radar.tx_field(sent)[0] @ radar.rx_field(look)[0]) ** 2)
        sigma = bistatic_sigma(points, p, -sent[0], -look[0])
        power = (
            radar.power * gain * (C0 / radar.waveform.middle) ** 2 * sigma / ((4.0 * np.pi) ** 3 * (near * far) ** 2)
        )
        case = scene.bodies[b].swerling
        snr = float(db(power / noise))
        probability = detection_probability(snr + _COHERENT_DB[case], detector, case if case in (1, 3) else 0)
        found.append(
            TargetLink(scene.bodies[b].name, 0.5 * (near + far), float(db(sigma)), snr, case, float(probability))
        )
    return tuple(found)
