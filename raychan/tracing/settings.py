"""How finely tubes are cut for a tolerance, and all that tracing knows of a radar: the prune rule."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.radar.beam_table import Beam
from raychan.tracing.tubes import NEAR, Refinement
from raychan.units import C0

Floats = NDArray[np.float64]

# Of the floor, half of the noise: what a curved surface reflects at a specular point may be left uncut. With 1 in
# launches that refine, an urban frame at 3 dB takes 1.3 times the CPU, and no more echoes over two spheres are found;
# with twice this in the first launch it takes 0.95 times, and one of 22 echoes 20 to 38 dB above the noise is lost
# (command not kept).
_SPECULAR = 3.0
_ALIKE = 1e-9  # of a wavelength, a carrier, a field: what rounding changes


@dataclass(frozen=True, eq=False)
class PruneRule:
    """What tracing may leave out: all that it knows of the radar that it traces for.

    `position` (3,) [m] of the radar, `beam` of its antennas (None: alike in all directions), `noise`
    [1/m] the noise-equivalent amplitude of a cell of its map; `refinement` how finely tubes are cut, with the
    wavenumber and the range cell of the radar; the most `bounces` (both legs counted), and whether single
    `diffraction` on the legs to point targets is traced.
    """

    position: Floats
    beam: Beam | None
    refinement: Refinement
    bounces: int
    noise: float = 0.0
    diffraction: bool = False
    rx: Floats | None = None
    """Position (3,) [m] of a receiver elsewhere."""

    def refusal(self, other: PruneRule) -> str:
        """Return why routes traced by this rule do not serve the radar of another, empty where they do."""
        mine, theirs = self.refinement, other.refinement
        ends = [(x.position, x.position if x.rx is None else x.rx) for x in (self, other)]
        if max(np.linalg.norm(a - b) for a, b in zip(*ends, strict=True)) > _ALIKE:
            return "its position differs: trace the scene for it"
        if abs(theirs.wavenumber - mine.wavenumber) > _ALIKE * mine.wavenumber:
            return "its carrier differs, for whose wavelength tubes are cut: trace the scene for it"
        if other.noise < self.noise * (1.0 - _ALIKE):
            return "its noise is lower than the level below which tubes were pruned: trace the scene for it"
        if theirs.cell < mine.cell * (1.0 - _ALIKE):
            return "its bandwidth is larger than the one for which tubes were cut: trace the scene for it"
        if self.beam is not None and (other.beam is None or (other.beam.table > self.beam.table + _ALIKE).any()):
            return "its antennas reach farther than those that tubes were launched for: trace the scene for it"
        return ""


def refinement(
    frequency: float,
    tolerance_db: float,
    floor: float = 0.0,
    layers: int = 2,
    jitter: float = 0.0,
    cell: float = np.inf,
) -> Refinement:
    """Return how finely tubes must be cut for a tolerance [dB].

    Args: floor [1/m] the scattered amplitude that drowns in noise; layers that a stretch may pass; jitter another
    lattice; cell [m] of two-way length that the radar tells apart. The constants are those at which two launches of the
    shapes in the tests differ by about half the tolerance; at half the noise a tube, cells 13 dB above it do: a coarser
    tolerance leaves no more than that, for what many tubes under a higher floor leave adds up to more than is stated.
    """
    fine = tolerance_db / 0.5
    least = 0.5 * floor * min(fine, 1.0)
    return Refinement(
        wavenumber=2.0 * np.pi * frequency / C0,
        phase=min(0.2, 0.1 * fine),
        turn=min(0.3, 0.15 * fine),
        relative=min(0.15, 0.05 * fine),
        max_edge=0.3 * min(1.0, np.sqrt(fine)),
        near=NEAR * min(1.0, np.sqrt(fine)),
        floor=least,
        specular=_SPECULAR * least,
        cell=cell,
        layers=layers,
        slots=8 + layers,
        jitter=jitter,
    )
