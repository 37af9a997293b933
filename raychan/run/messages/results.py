"""Lines that a run prints and stores: on detections that are not converged or folded, on the tolerance, and on
unmodelled effects that matter to the weakest detection."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from raychan.processing.staggered import ResolvedMap
from raychan.radar.radar import Radar
from raychan.records import RangeDoppler
from raychan.run.explanation.two_ways import apart
from raychan.run.ledger_entry import SEEN, Entry
from raychan.run.messages.lost_levels import lost
from raychan.run.numbered import numbers, share_of, verb
from raychan.run.result import DC, IMAGE, INTERFERENCE, SIDELOBE, ExplainedDetections, Explanation, Result

_LEAST_DB = 0.5  # above the weakest detection: rounds to 1 dB or more


def counts(found: ExplainedDetections, tolerance_db: float | None) -> dict[str, float]:
    """Return the counts of summary.json; `reached_db` is the worst error that is a figure. Without a tolerance, as in a
    preview, none is over it."""
    known = found.error_db[found.converged]
    over = {} if tolerance_db is None else {"over_tolerance": int((known > tolerance_db).sum())}
    return {
        "reached_db": float(known.max(initial=0.0)),
        **over,
        "not_converged": int((~found.converged).sum()),
        "folded": int(found.folded.sum()),
    }


def warned(found: ExplainedDetections, tolerance_db: float, rdmap: RangeDoppler) -> list[str]:
    """Return a line if detections are not converged, and one if some are folded, or ambiguous."""
    said = []
    if (~found.converged).any():
        rows = ~found.converged
        said.append(
            f"{share_of(rows)} {verb(rows)} not converged ({numbers(rows)}): the last two launches "
            f"differ there by about as much as they find, so the error is unknown; more of the budget that "
            f"ended it (model.max_rays, max_seconds, max_memory_mb) or a smaller tolerance than {tolerance_db:g} dB "
            "(--tolerance, model.tolerance_db) may help"
        )
    if found.folded.any():
        first = int(np.flatnonzero(found.folded)[0])
        shown, true = (
            _place(found.range[first], found.rate[first]),
            _place(found.true_range[first], found.true_rate[first]),
        )
        limit, open_ = rdmap.unambiguous_rate, ""
        if isinstance(rdmap, ResolvedMap):
            limit = rdmap.resolved_rate
            near = (found.true_range <= rdmap.unambiguous_range) & (np.abs(found.true_rate) <= limit)
            open_ = ", and a slower one where noise leaves its fold open" if (found.folded & near).any() else ""
        said.append(
            f"{share_of(found.folded)} {verb(found.folded)} folded ({numbers(found.folded)}): beyond "
            f"{rdmap.unambiguous_range:.4g} m or {limit:.4g} m/s an echo shows elsewhere{open_}; "
            f"number {first + 1} is at {true}, shown at {shown}"
        )
    said += unsure(found, rdmap)
    return said


def mirrored(found: ExplainedDetections, rdmap: RangeDoppler, radar: Radar) -> list[str]:
    """Return a line if an array's detections are mirror images of real sampling, whose directions are not their own."""
    spans = np.floor(np.nan_to_num(found.true_range) / rdmap.unambiguous_range)
    rows = found.folded & (spans % 2 == 1) & (np.isfinite(found.azimuth) | np.isfinite(found.elevation))
    if radar.waveform.complex_sampling or not rows.any():
        return []
    slots = ", and by Doppler division in several wrong directions" if radar.multiplexing == "ddm" else ""
    return [
        f"{share_of(rows)} {verb(rows)} mirrored ({numbers(rows)}): with real sampling echoes beyond "
        f"{rdmap.unambiguous_range:.4g} m show at minus their rates and on the other side of boresight{slots}"
    ]


def unsure(found: ExplainedDetections, rdmap: RangeDoppler) -> list[str]:
    """Return a line if detections are ambiguous in rate and direction together, and one if some are in direction."""
    said, rows = [], np.zeros(len(found.range), bool)
    if isinstance(rdmap, ResolvedMap):
        rows = found.ambiguous & rdmap.open[tuple(found.cell.T)]
    if rows.any():
        said.append(
            f"{share_of(rows)} {verb(rows)} ambiguous in rate and direction ({numbers(rows)}): another rate, a "
            f"multiple of {2.0 * rdmap.unambiguous_rate:.4g} m/s away, explains what the receivers see as well, from "
            "another or the same direction; the slowest rate is given"
        )
    if (rows := found.ambiguous & ~rows).any():
        said.append(
            f"{share_of(rows)} {verb(rows)} ambiguous in direction ({numbers(rows)}): "
            "a grating lobe of the elements, or the other end of their view, shows another direction alike, or too "
            "nearly so for the noise, or more echoes share a cell than were told apart, or those of a cell may be one "
            "near wave; of equal ones that nearest boresight is given"
        )
    return said


_NO_ECHOES = {
    SIDELOBE: (
        ("is a side lobe of stronger echoes", "are side lobes of stronger echoes"),
        "noise covers most of them (radar.noise), windows of lower side lobes have fewer (processing)",
    ),
    DC: (
        ("is the receiver's DC offset", "are the receiver's DC offset"),
        "it is a constant in all samples (radar.impairments.dc_offset_dbm)",
    ),
    IMAGE: (
        ("is an I/Q image of a stronger echo", "are I/Q images of stronger echoes"),
        "images are at minus the range and rate of their echoes (radar.impairments.iq_gain_db, iq_phase_deg)",
    ),
    INTERFERENCE: (
        ("is what another radar sends", "are what other radars send"),
        "ramps like the radar's own look like an echo, others lift the noise (interferers)",
    ),
}
"""What a detection of a label is, and detections are; and why something is shown there."""


def no_echoes(reasons: Sequence[Explanation]) -> list[str]:
    """Return a line each if detections are side lobes of echoes elsewhere, what the receiver itself makes or what other
    radars send."""
    said = []
    for label, ((one, more), why) in _NO_ECHOES.items():
        rows = np.array([reason.label == label for reason in reasons], bool)
        if rows.any():
            what = one if rows.sum() == 1 else more
            said.append(f"{share_of(rows)} {what} ({numbers(rows)}), and nothing stands where shown: {why}")
    return said


def not_reciprocal(reasons: Sequence[Explanation], tolerance_db: float) -> list[str]:
    """Return a line if levels of detections are off reciprocity by more than the tolerance and what is stated."""
    off = np.array([reason.reciprocity_db for reason in reasons], float)
    stated = np.array([reason.error_db for reason in reasons], float)
    rows = off > np.fmax(stated, tolerance_db)
    if not rows.any():
        return []
    return [
        f"{share_of(rows)} {'changes' if rows.sum() == 1 else 'change'} ({numbers(rows)}), by up to "
        f"{off[rows].max():.1f} dB, with the surface on which waves over several are taken to scatter, which "
        "reciprocity makes alike: no stated error has it; corners seen off the direction in which rays come back "
        "return by their edges only"
    ]


def two_ways(reasons: Sequence[Explanation], radar: Radar | None) -> list[str]:
    """Return a line if echoes before several transmitters leave and return in different directions."""
    rows = np.zeros(len(reasons), bool)
    rows[apart(reasons, radar) if radar is not None else []] = True
    if not rows.any():
        return []
    is_one = rows.sum() == 1
    return [
        f"{share_of(rows)} {'leaves' if is_one else 'leave'} in one direction and {'returns' if is_one else 'return'} "
        f"from another ({numbers(rows)}), over several surfaces: to several transmitters that is no plane wave, so one "
        "echo may show several times, and directions, and rates that are found by them, may be wrong"
    ]


def noted(found: ExplainedDetections, tolerance_db: float, ledger: Mapping[str, Entry]) -> list[str]:
    """Return the lines that stand below the table of detections: on the tolerance, and on what was left out."""
    said = []
    stated = counts(found, tolerance_db)
    n, over = len(found.range), stated["over_tolerance"]
    # A preview refines nothing: no tolerance counts.
    if (over or stated["not_converged"]) and "preview" not in ledger:
        within = n - over - stated["not_converged"]
        said.append(
            f"{within} of {n} detections within the tolerance of {tolerance_db:g} dB{_above(found, tolerance_db)}"
        )
    least = "the weakest detection" if n else "the weakest detection possible"
    if above := _listed(ledger, _LEAST_DB, math.inf):
        said.append(f"left out, above {least}: {above} (see left_out in summary.json of raychan run)")
    said += [f"left out, of unknown level: {name}: {e.how}" for name, e in ledger.items() if e.kind == SEEN]
    # What adds in phase to the weakest detection moves it by so much.
    moves_db = 20.0 * math.log10(10.0 ** (tolerance_db / 20.0) - 1.0) if tolerance_db < math.inf else math.inf
    if below := _listed(ledger, moves_db, _LEAST_DB):
        said.append(f"left out, below {least} but may move {'it' if n else 'one'} by over {tolerance_db:g} dB: {below}")
    return said


def told(
    found: ExplainedDetections,
    reasons: Sequence[Explanation],
    tolerance_db: float,
    rdmap: RangeDoppler,
    ledger: Mapping[str, Entry],
    radar: Radar | None,
) -> list[str]:
    """Return all lines on detections, of which each has a reason."""
    return [
        *no_echoes(reasons),
        *not_reciprocal(reasons, tolerance_db),
        *two_ways(reasons, radar),
        *warned(found, tolerance_db, rdmap),
        *([] if radar is None else [*mirrored(found, rdmap, radar), *lost(found, reasons, radar)]),
        *noted(found, tolerance_db, ledger),
    ]


def notes(result: Result) -> list[str]:
    """Return the lines below a result's table; its warnings contain them too."""
    return noted(result.detections, float(result.stats.get("tolerance_db", math.inf)), result.ledger)


def findings(result: Result) -> list[str]:
    """Return all lines on a result's detections."""
    tolerance = float(result.stats.get("tolerance_db", math.inf))
    radar = result.scene.radar if result.scene is not None else None
    return told(result.detections, result.provenance, tolerance, result.rdmap, result.ledger, radar)


def marks(found: ExplainedDetections) -> str:
    """Return the counts of marked detections, as ', 2 not converged, 1 folded'; '' where there are none."""
    counted = {"not converged": int((~found.converged).sum()), "folded": int(found.folded.sum())}
    return "".join(f", {n} {word}" for word, n in counted.items() if n)


def _above(found: ExplainedDetections, tolerance_db: float) -> str:
    """Return which detections state errors above the tolerance, and the largest; '' where none does."""
    known = np.where(found.converged, found.error_db, 0.0)
    if not (rows := known > tolerance_db).any():
        return ""
    # As many digits as tell it from the tolerance.
    texts = [f"{known.max():.{digits}f}" for digits in (1, 2, 3, 6)]
    shown = next((text for text in texts if float(text) > tolerance_db), texts[-1])
    return f"; above it {verb(rows)} {numbers(rows)}, the largest error stated is {shown} dB"


def _listed(ledger: Mapping[str, Entry], least: float, below: float) -> str:
    """Return names and levels of the mechanisms that the ledger puts from `least` to `below` [dB] over the weakest
    detection, the strongest first."""
    found = [(e.level_db, name, e.kind) for name, e in ledger.items() if isinstance(e.level_db, float)]
    found = sorted((x for x in found if least <= x[0] < below), reverse=True)
    return ", ".join(
        f"{name} {'at most ' if kind == 'bound' else ''}{round(level) + 0.0:+.0f} dB" for level, name, kind in found
    )


def _place(range: float, rate: float) -> str:
    speed = "an unknown rate" if np.isnan(rate) else f"{rate:+.2f} m/s"
    return f"{range:.2f} m, {speed}"
