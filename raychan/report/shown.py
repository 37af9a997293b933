"""The pictures of `.plot()` of a result, a map or a profile, for a notebook or a window."""

from __future__ import annotations

from typing import Any

import numpy as np

from raychan.processing.range_azimuth import RangeAzimuth
from raychan.records import Profile, RangeDoppler
from raychan.report.canvas import show_figure, style
from raychan.report.direction_figures import draw_range_azimuth
from raychan.report.figures import levels, profile_picture, rdmap_picture
from raychan.report.spectrogram_figure import draw_spectrogram
from raychan.run.result import Result
from raychan.run.spectrogram import Spectrogram
from raychan.units import dbm, watt


def draw(thing: Any, axes: Any = None) -> Any:
    """Draw a Result, a RangeDoppler, a RangeAzimuth, a Profile or a Spectrogram and return the axes.

    Args: axes to draw into; of a Result two, for map and profile; None makes a figure of pyplot.
    Raises: ValueError for other axes.
    """
    if axes is not None:
        _check(axes, 2 if isinstance(thing, Result) else 1)
    with style():
        if isinstance(thing, Result):
            if axes is None:
                axes = _two()
            rdmap_picture(thing, axes=axes[0])
            profile_picture(thing, axes=axes[1])
            return axes
        if axes is None:
            axes = show_figure(8.2, 4.6).add_subplot()
        if isinstance(thing, RangeDoppler):
            _map(thing, axes)
        elif isinstance(thing, Spectrogram):
            draw_spectrogram(thing, axes)
        elif isinstance(thing, RangeAzimuth):
            draw_range_azimuth(thing, axes)
        elif isinstance(thing, Profile):
            axes.plot(thing.range, dbm(np.maximum(thing.power, watt(-300.0))), lw=1.1, color="#225588")
            axes.set(xlabel="range [m]", ylabel="received power [dBm]", title="Power-delay profile")
        else:
            raise TypeError(f"there is no picture of a {type(thing).__name__}")
    return axes


def _check(axes: Any, count: int) -> None:
    """Raise ValueError unless axes are those of matplotlib, one or a sequence of two."""
    given = [axes] if count == 1 else list(np.ravel(axes))
    if len(given) != count or not all(hasattr(x, "pcolormesh") for x in given):
        wanted = "an Axes of matplotlib is" if count == 1 else "two Axes of matplotlib are"
        raise ValueError(f"axes = {axes!r}: {wanted} wanted, or None")


def _two() -> tuple[Any, Any]:
    """Return axes of fixed position for map and profile: labels are placed when the map is drawn and must not move."""
    made = show_figure(8.2, 8.2, layout=None)
    made.subplots_adjust(left=0.1, right=0.97, bottom=0.07, top=0.96, hspace=0.28)
    return tuple(made.subplots(2, 1, height_ratios=(4.6, 3.6)))


def _map(m: RangeDoppler, axes: Any) -> None:
    power = dbm(np.maximum(m.power, watt(-300.0)))
    low, top = levels(m, power)
    image = axes.pcolormesh(
        m.range, m.rate, power, vmin=low, vmax=top, cmap="viridis", shading="nearest", rasterized=True
    )
    axes.set(xlabel="range [m]", ylabel="range rate [m/s]   (receding is positive)", title="Range-Doppler map")
    axes.figure.colorbar(image, ax=axes, label="received power [dBm]", pad=0.01, aspect=30)
