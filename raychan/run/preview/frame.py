"""Preview: a frame of a scene in a fraction of a second, coarse and said to be so.

Each body returns what it scatters once, seen directly or over the ground: one launch, no refinement, no bounces from
body to body or within one, no diffraction, and one tracing a frame.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from raychan.channel.error import COVER
from raychan.channel.paths import join, nothing, paths_of
from raychan.parallel import run_pair
from raychan.poses import sizes
from raychan.radar.radar import Radar
from raychan.records import MapError, Paths, Points, RangeDoppler
from raychan.run.clutter import scatters_diffusely
from raychan.run.ledger_entry import UNKNOWN, Entry
from raychan.run.path_stream import Launched
from raychan.run.preview.launch import preview_routes
from raychan.run.receiver import noise_amplitude, noise_equivalent_amplitude, noise_of_cell
from raychan.run.rules import rule_of
from raychan.signal.baseband import synthesize
from raychan.tracing.settings import PruneRule, refinement
from raychan.tracing.solver import Batch
from raychan.tracing.stats import Stats
from raychan.units import C0
from raychan.world.geometry import Geometry

# What levels are stated to be off by: they cover 167 of 168 direct echoes of 30 random scenes and two streets; one of
# 20.9 dB SNR is off by 5.5 dB (command not kept, as `make bench BENCH="--only preview"` measures), and a lamp post of
# 41.7 dB SNR by 3.4 dB (a random scene; command not noted). Less covers fewer, more tells less.
_SHARE_DB = 4.0  # of any detection
_WEAK = 4.0  # times the noise's amplitude: what else weak ones are off by

_BOUNCES = 3  # over the ground, to a body, and over the ground
_TOLERANCE_DB = 1.0  # for which tubes are cut: the limits on their phase grow no further (tracing.settings)
_LEVEL = 1e-4  # of the sum of all amplitudes: error of the samples
# They trade tubes against levels that pruned tubes change, by sums as `launch.that_count` counts them. With all
# sums in phase, cells of direct echoes were off by 0.7 dB (rms), 2 dB at most, beside fine runs of the living street;
# at floor 10 by 1.1 and 5.7 dB for 8 % less time of tracing, at relative 8 by 0.8 and 4 dB for 6 % (command not noted).
_FLOOR = 6.7  # of the noise-equivalent amplitude: pruned tubes of a range cell add up to 0.3 of that
_RELATIVE = 5.0  # of what is found in a range cell, for a hundred tubes: pruned ones add up to 0.15 of what is found
# Of what is found in a range cell, for the cells next to it: what a Hann window leaves at 1.35 cells. With 1 luminaires
# of 3 of 40 lone lamp posts 1.5 to 5 m away are lost, with 0.5 of 1, with 0.25 none, for 1.3 times the paths of such a
# post and 0.3 to 1.7 % more rays of three bundled scenes; with 0.1 none, for 1.5 times the paths (no command).
_BESIDE = 0.25
# Times the noise by which a fine run tells corners of a footprint apart in range: more takes fewer paths (37,000 and
# 18,000 of the urban street at 1 and 30, 10 ms of CPU; command not kept) and smears footprints in range: a hundred
# of them in one cell err by 0.3 of its noise.
_WHOLE = 30.0
# m: of tubes. While all were seen or hidden as a whole, at 2 m an echo of the urban street was off by 7 dB, at 0.6 m
# by 4.
_EDGE = 0.6

LEFT_OUT = (
    "bounces from body to body and within a body (corners), diffraction, shadow edges across weak facets, and motion "
    "within the frame other than constant rates"
)


def preview_of(geometry: Geometry, points: Points, radar: Radar, settings: Any, model: Any) -> tuple[Launched, Stats]:
    """Return the launch of a preview and what it cost; args as for `scene_refinement.SceneRefinement`."""
    stats, carrier = Stats(), radar.waveform.carrier
    noise = preview_noise(radar, settings)

    def carried(batch: Batch) -> Paths:
        return paths_of(batch, geometry.facets, radar, carrier, noise)

    every = preview_routes(geometry, points, radar, preview_rule(radar, settings, model), stats, carried)
    paths = join([nothing(geometry.facets, radar), *every])
    launched = Launched(paths, len(paths.length), replace(radar, noise=False), settings.range_window)
    quiet, profile = run_pair(
        lambda: synthesize(paths, launched.radar, tolerance=_LEVEL).samples, lambda: launched.response
    )
    return replace(launched, sums=(quiet, profile)), stats


def preview_noise(radar: Radar, settings: Any) -> float:
    """Return the amplitude of noise that hides what telling a footprint's corners apart changes."""
    return _WHOLE * noise_amplitude(radar, settings)


def preview_rule(radar: Radar, settings: Any, model: Any) -> PruneRule:
    """Return the prune rule of a preview."""
    noise, cell = noise_equivalent_amplitude(radar, settings), C0 / radar.waveform.bandwidth
    fine = refinement(radar.waveform.carrier, _TOLERANCE_DB, noise, model.max_transmissions, 0.0, cell)
    coarse = replace(fine, floor=_FLOOR * noise, relative=_RELATIVE, beside=_BESIDE, max_edge=_EDGE)
    return rule_of(radar, noise, coarse, min(model.max_bounces, _BOUNCES))


def preview_error(rdmap: RangeDoppler, radar: Radar, settings: Any) -> MapError:
    """Return how wrong the levels of a preview may be in each cell of its map."""
    share = (1.0 - 10.0 ** (-_SHARE_DB / 20.0)) / COVER
    return MapError(share**2 * np.asarray(rdmap.power) + (_WEAK / COVER) ** 2 * noise_of_cell(radar, settings))


def preview_notes() -> tuple[str, ...]:
    """Return the line by which a preview says what it is."""
    return (
        f"preview: levels may be off by {_SHARE_DB:g} dB, those of weak echoes and of bodies seen in part by more; "
        f"left out: {LEFT_OUT}",
    )


def preview_ledger(geometry: Geometry, radar: Radar, model: Any) -> dict[str, Entry]:
    """Return the ledger of a preview, without estimates: what any leaves out, and what this scene has that settings
    leave out, by the names of a fine run."""
    f, reach = geometry.facets, radar.waveform.unambiguous_range
    found = {"preview": Entry(UNKNOWN, "none", f"left out: {LEFT_OUT}")}
    if model.max_transmissions == 0 and (f.materials.thickness[f.material] > 0.0).any():
        how = "model.max_transmissions is 0: what stands behind thin layers is not traced"
        found["transmission"] = Entry(UNKNOWN, "none", how)
    rough = scatters_diffusely(f, model)[f.material]
    if (sizes(f.vertices[rough] - radar.position) > reach).any():
        how = f"returns of rough surfaces beyond the unambiguous range of {reach:.4g} m would fold in"
        found["diffuse scattering"] = Entry(UNKNOWN, "none", how)
    return found
