"""Picture of the probability of detection against SNR: the five Swerling cases, and a scene's targets on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from raychan.processing.detection_theory import Detector, detection_probability, simulated
from raychan.report.canvas import PALETTE, drawn_as, figure, style, verbatim
from raychan.run.target_links import TargetLink

_STEPS = 141  # points of a curve
_DRAWS = 20_000  # noise draws of a dot: its standard deviation is 0.0035 at most


def detection_picture(detector: Detector, links: Sequence[TargetLink], title: str, suffix: str = ".png") -> memoryview:
    """Draw the probability of detection of each Swerling case against the SNR of a cell and return the file's bytes.

    Lines are the closed forms, dots are noise draws, rings the targets of a scene at their SNR; suffix of the file.
    """
    low = max(detector.min_snr_db, 5.0) - 10.0
    snr = np.linspace(low, low + 35.0, _STEPS)
    rng = np.random.default_rng(0)
    with style():
        made = figure(7.2, 4.4)
        axes = made.add_subplot()
        # Of one look, from frame to frame and from chirp to chirp are the same.
        one = {0: "0", 1: "1, 2", 3: "3, 4"}
        names = one if detector.looks == 1 else {case: str(case) for case in range(5)}
        for (case, name), colour in zip(names.items(), PALETTE, strict=False):
            axes.plot(snr, detection_probability(snr, detector, case), color=colour, label=f"Swerling {name}")
            dots = snr[::10]
            axes.plot(dots, [simulated(x, detector, case, _DRAWS, rng) for x in dots], ".", color=colour)
        axes.plot([], [], ".", color="#444444", label=f"{_DRAWS:,} draws of noise")
        for k, link in enumerate(links):
            at, shift = (link.snr, link.probability), (5, 4 - 9 * (k % 4))
            axes.plot(*at, "o", color="black", fillstyle="none")
            axes.annotate(verbatim(link.name), at, xytext=shift, textcoords="offset points")
        if links:
            axes.plot([], [], "o", color="black", fillstyle="none", label="targets of the scene")
        axes.set(
            xlabel="mean SNR of one look [dB]",
            ylabel="probability of detection",
            ylim=(-0.02, 1.05),
            title=verbatim(title),
        )
        axes.grid(alpha=0.3)
        made.legend(loc="outside right upper")
        return drawn_as(made, suffix)
