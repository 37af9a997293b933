"""The validation report as Markdown: printed and simulated figures by table and claim, with the known differences."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

import numpy as np

from raychan import __version__
from raychan.radar.pattern import characteristics
from raychan.report.reflector_figures import reflector_section
from raychan.report.validation_page import anchor
from raychan.study.validation.formulas import ARRAY, both_ways
from raychan.study.validation.judge import AGREES, DIFFERS, UNTESTABLE, Check, of_item, shown, verdict
from raychan.study.validation.sections import Ablation, ArrayGain, Budget, Ghost
from raychan.study.validation.validate import Validation

_LINK = (("range", 2), ("azimuth_deg", 1), ("rcs_dbsm", 2), ("gain_dbi", 2), ("snr_db", 1))
_HEADS = ("printed", "simulated", "difference", "tolerance", "verdict")


def markdown(
    done: Validation,
    sections: tuple[list[Ablation], list[Ghost], list[Budget], list[ArrayGain]] | None,
    figures: dict[str, str],
) -> str:
    """Return the report.

    Args: sections beyond tables and claims, or None where only some items were tested; figures, file names by name.
    """
    lines = [*_overview(done)]
    if sections:
        made, ghosts, budgets, gains = sections
        lines += [*_ablations(made, figures), *_ghosts(done, ghosts), *_budgets(budgets, figures)]
        lines += _array_gains(done, gains, figures)
        lines += reflector_section(figures)
    lines += [*_tables(done, figures), *_claims(done), *_known(done)]
    if done.bench.results:
        lines += _runs(done)
    return "\n".join([*_head(done), *_contents(lines), *lines]) + "\n"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table, with an empty line after it."""
    rows = list(rows)
    sides = [" ---: |" if rows and all(map(_numeric, column)) else " --- |" for column in zip(*rows, strict=True)]
    lines = ["| " + " | ".join(heads) + " |", "|" + "".join(sides or [" --- |"] * len(heads))]
    return [*lines, *("| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in rows), ""]


def _numeric(cell: str) -> bool:
    return re.fullmatch(r"([+-]?[\d,.]+)?", cell) is not None


def _contents(lines: Sequence[str]) -> list[str]:
    heads = [line.removeprefix("## ") for line in lines if line.startswith("## ")]
    return [" · ".join(f"[{head}](#{anchor(head)})" for head in heads), ""]


def _head(done: Validation) -> list[str]:
    counts = {v: sum(c.verdict == v for c in done.checks) for v in (AGREES, DIFFERS, UNTESTABLE)}
    coarse = done.bench.tolerance_db
    tolerance = "each scene's own" if coarse is None else f"{coarse:g} dB"
    lines = [
        "# Validation", "",
        "The tables and claims of a ray-tracing study of 77 GHz FMCW radar in urban traffic (C001 to C052), the claims "
        "of a published FMCW model (C059 to C074), and those of a published ship simulation with a laser scanner (C081 "
        "to C103), compared with simulations by raychan. Written by "
        "`raychan validate`; the scenes are in `scenes/`, the printed figures in `validation/`. "
        "The study's ranges and speeds are inputs of the scenes: their agreement tests the chain from the wave to the "
        "detection. Lateral positions and shapes of bodies are inferred. All scenes have one noise figure; nothing is "
        "fitted per target.", "",
        f"**{len(done.checks)} figures: {counts[AGREES]} agree, {counts[DIFFERS]} differ, {counts[UNTESTABLE]} cannot "
        f"be tested as printed.** Every difference is listed by name with its reason: "
        f"{'yes' if not done.problems else 'no, see below'}.", "",
        f"raychan {__version__}, launch tolerance {tolerance}, {done.seconds:.0f} s.", "",
    ]  # fmt: skip
    if done.problems:
        lines += ["## Problems", "", *(f"- {p}" for p in done.problems), ""]
    return lines


def _overview(done: Validation) -> list[str]:
    rows = []
    for item in done.items:
        checks = of_item(item, done.checks)
        counts = [sum(c.verdict == v for c in checks) for v in (AGREES, DIFFERS, UNTESTABLE)]
        rows.append((_link(item.id), item.title, *map(str, counts), verdict(checks)))
    heads = ("", "table or claim", "agree", "differ", "not testable", "verdict")
    return ["## Overview", "", *table(heads, rows)]


def _link(item: str) -> str:
    return f"[{item}](#{item.lower()})" if item.startswith("T") else item


def _cells(check: Check) -> tuple[str, ...]:
    f = check.figure
    simulated = shown(check.simulated)
    if check.simulated is None and f.measure[0] == "antenna":
        simulated = "none"
    if check.note and check.verdict != UNTESTABLE:
        simulated += f" ({check.note})"
    off = "" if check.difference is None else _difference(check.difference)
    said = check.verdict + (f" ({check.known})" if check.known else "")
    return f"{_printed(f.printed)} {f.unit}".strip(), simulated, off, _tolerance(check), said


def _difference(off: float) -> str:
    """Return two significant digits, but no more than four decimals: '+0.012', '-12', '+759,164'."""
    if abs(off) < 0.5e-4:
        return "0"
    return f"{off:+,.{min(4, max(0, 1 - math.floor(math.log10(abs(off)))))}f}"


def _printed(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else shown(value)  # type: ignore[arg-type]


def _tolerance(check: Check) -> str:
    f = check.figure
    if check.verdict == UNTESTABLE:
        return ""
    if f.at_most or f.at_least:
        return "at most" if f.at_most else "at least"
    if not f.within:
        return "equal"
    return f"{f.within:g}" if f.below is None else f"-{f.below:g}, +{f.within:g}"


def _why(done: Validation, checks: Iterable[Check]) -> list[str]:
    """Return a line for each known difference of the checks, and for each reason why some cannot be tested."""
    checks = list(checks)
    known = {k.id: k.reason for k in done.study.known}
    lines = [f"- differs, {name}: {known[name]}" for name in dict.fromkeys(c.known for c in checks) if name]
    reasons = dict.fromkeys(c.figure.untestable for c in checks if c.verdict == UNTESTABLE)
    lines += [f"- cannot be tested ({r}): {done.study.reasons[r]}" for r in reasons]
    return [*lines, ""] if lines else []


def _tables(done: Validation, figures: dict[str, str]) -> list[str]:
    items = [i for i in done.items if i.id.startswith("T")]
    lines = ["## Tables", ""] if items else []
    if items and "offs" in figures:
        lines += [
            f"![Ranges and speeds]({figures['offs']})", "",
            "All ranges and speeds of the tables: simulated less printed, in tolerances. Shaded: agrees. At the right "
            "edge, a cross: not detected; a dot: beyond the axis.", "",
            f"![Levels]({figures['levels']})", "",
        ]  # fmt: skip
    for item in items:
        checks = of_item(item, done.checks)
        lines += [f"### {item.id}", "", f"{item.title}. {item.note}".strip(), ""]
        lines += table(("figure", *_HEADS), [(c.figure.name, *_cells(c)) for c in checks])
        lines += _why(done, checks)
    return lines


def _claims(done: Validation) -> list[str]:
    items = [i for i in done.items if i.id.startswith("C")]
    rows, checks = [], []
    for item in items:
        for n, c in enumerate(of_item(item, done.checks)):
            first = (item.id, f"{item.title} ({item.where})") if n == 0 else ("", "")
            rows.append((*first, c.figure.name, *_cells(c)))
            checks.append(c)
    if not items:
        return []
    return ["## Claims", "", *table(("", "claim", "figure", *_HEADS), rows), *_why(done, checks)]


def _known(done: Validation) -> list[str]:
    rows = []
    for k in done.study.known:
        covered = [c.key for c in done.checks if c.known == k.id]
        if covered:
            rows.append((k.id, k.kind, ", ".join(covered), k.reason))
    heads = ("difference", "kind", "figures", "reason")
    return ["## Known differences", "", *table(heads, rows)] if rows else []


def _ablations(made: Sequence[Ablation], figures: dict[str, str]) -> list[str]:
    rows = [(a.title, *(a.echoes[e].text() for e in a.echoes), str(a.detections)) for a in made]
    heads = ("scene", "ghost, both ways over the truck", "direct return", "ghost, one way over the truck", "detections")
    return [
        "## What makes the ghost", "",
        "The scene of the occluded pedestrian with one change at a time: range, SNR and stated error of each echo; "
        "where it is not detected (below the threshold, or merged with a stronger echo), the SNR of its paths alone, "
        "without noise.", "",
        f"![Ghost]({figures['ghost']})", "",
        *table(heads, rows),
    ]  # fmt: skip


def _ghosts(done: Validation, ghosts: Sequence[Ghost]) -> list[str]:
    rows = [
        (done.study.runs[g.run].title, f"{g.range:.2f}", f"{g.snr:.1f}", g.text, f"{g.range - g.path:+.3f}",
         f"{g.cell:.4f}", "yes" if g.explained else "no" if g.converged else "not converged")
        for g in ghosts
    ]  # fmt: skip
    heads = ("run", "range m", "SNR dB", "leading path", "detected less path m", "range bin m", "explained")
    intro = (
        "All multipath detections of all runs, and the path whose length explains the range of each. Of one that is "
        "not converged the level is not known, and so not whether it is there."
    )
    return ["## Every ghost and its path", "", intro, "", *table(heads, rows)]


def _budgets(budgets: Sequence[Budget], figures: dict[str, str]) -> list[str]:
    rows = []
    for b in budgets:
        link = b.link
        whole = "no path" if b.whole is None else f"{b.whole:.1f}" + ("" if b.detected else ", not detected")
        direct = "blocked" if b.direct is None else f"{b.direct:.1f}"
        printed = [f"{b.printed[c]:g}" if c in b.printed else "" for c in ("snr_1", "snr_4")]
        off = f"{b.whole - b.printed['snr_4']:+.1f}" if b.whole is not None and "snr_4" in b.printed else ""
        budget_off = f"{link['snr_db'] - b.printed['snr_4']:+.1f}" if "snr_4" in b.printed else ""
        given = (f"{link[key]:.{n}f}" for key, n in _LINK)
        rows.append((b.title, *given, direct, whole, *printed, budget_off, off))
    heads = (
        "", "range m", "azimuth deg", "RCS dBsm", "gain dBi", "link budget", "simulated, direct path",
        "simulated, all paths", "printed, 1 GHz", "printed, 4 GHz", "budget less printed", "simulated less printed",
    )  # fmt: skip
    return [
        "## Pedestrians against the link budget", "",
        "SNR in dB with the patch at 4 GHz. Link budget: P G² λ² σ / ((4π)³ R⁴) over the noise k T0 F f_s of a "
        "sample, plus the gain of chirps and samples with Hann windows; the noise figure F is that of all scenes and "
        "the only free number. The direct path alone must agree with it; ground and neighbouring bodies add the "
        "difference to all paths. Azimuths are inferred. Printed levels do not fall with range.", "",
        f"![Pedestrians]({figures['pedestrians']})", "",
        *table(heads, rows),
    ]  # fmt: skip


def _gained(gain: ArrayGain) -> str:
    if gain.simulated is None:
        return "no path"
    return f"{gain.simulated:+.1f}" + ("" if gain.detected else " (level, not detected with both)")


def _array_gains(done: Validation, gains: Sequence[ArrayGain], figures: dict[str, str]) -> list[str]:
    edge = 0.5 * characteristics(done.bench.scene(ARRAY).radar.tx).hpbw_h_deg
    most, at_edge = both_ways(done.bench, np.array([0.0, edge]))
    rows = [
        (t.title, f"{t.azimuth:.1f}", f"{t.pattern:+.1f}", _gained(t), f"{t.printed:+g}",
         "" if t.needs is None else f"{t.needs:.2f}")
        for t in gains
    ]  # fmt: skip
    heads = (
        "", "azimuth deg, inferred", "by the patterns", "simulated", "printed", "azimuth for the printed change, deg",
    )  # fmt: skip
    return [
        "## The array against the patch, by azimuth", "",
        "Change of SNR in dB from patch to 16 x 16 array, at equal noise. At boresight it is "
        f"{most:.1f} dB, twice the difference of the two gains; "
        f"half the array's beam width off boresight, at {edge:.2f} deg, it is {at_edge:.1f} dB. "
        "The study puts pedestrians 4 to 7 and car 3 in the main beam, but its printed changes occur at the flank of "
        "the beam or outside it (last column: the least azimuth at which the patterns give the printed change). The "
        "simulated change follows the patterns at the inferred azimuths, except where waves over the ground, which the "
        "array attenuates, or other parts of a wide body contribute.", "",
        f"![Array]({figures['array']})", "",
        *table(heads, rows),
    ]  # fmt: skip


def _runs(done: Validation) -> list[str]:
    rows = []
    for name, result in done.bench.results.items():
        given = done.study.runs[name]
        how = "; ".join([*given.changes, *([f"max_bounces={given.max_bounces}"] if given.max_bounces else [])])
        d = result.detections
        worst = d.error_db[d.converged].max(initial=0.0)
        figures = f"{result.stats['rays']:,}", str(len(d.range)), f"{worst:.1f}", str(int((~d.converged).sum()))
        rows.append((given.title, f"{given.scene}.toml", how, *figures, f"{sum(result.timings.values()):.0f}"))
    heads = ("run", "scene", "changed", "rays", "detections", "largest stated error dB", "not converged", "s")
    return ["## Runs", "", *table(heads, rows)]
