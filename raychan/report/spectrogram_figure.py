"""Picture of a spectrogram: received power against time and range rate."""

from __future__ import annotations

from typing import Any

import numpy as np

from raychan.report.canvas import drawn_as, figure, style, verbatim
from raychan.run.spectrogram import Spectrogram
from raychan.units import dbm, watt

_SPAN = 60.0  # dB below the peak: limbs are 20 to 40 dB below the trunk


def spectrogram_picture(found: Spectrogram, title: str, suffix: str = ".png") -> memoryview:
    """Draw a spectrogram and return the file's bytes; suffix of the file."""
    with style():
        made = figure(8.2, 4.6)
        draw_spectrogram(found, made.add_subplot(), title)
        return drawn_as(made, suffix)


def draw_spectrogram(found: Spectrogram, axes: Any, title: str = "Spectrogram") -> None:
    """Draw a spectrogram into axes."""
    power = dbm(np.maximum(found.power, watt(-300.0))).T
    top = float(power.max())
    low = max(top - _SPAN, float(dbm(found.noise)) - 3.0 if found.noise else -np.inf)
    image = axes.pcolormesh(
        found.time, found.rate, power, vmin=min(low, top - 1.0), vmax=top, cmap="viridis", shading="nearest",
        rasterized=True,
    )  # fmt: skip
    axes.set(xlabel="time [s]", ylabel="range rate [m/s]   (receding is positive)", title=verbatim(title))
    axes.figure.colorbar(image, ax=axes, label="received power [dBm]", pad=0.01, aspect=30)
