"""What a radar's receiver does with its samples: windows, zero padding, detector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from raychan.radar.declared import check_declared, is_whole
from raychan.scalars import is_one_of, meant, plain, shown

_WORDS = {"cfar": ("ca", "os"), "beams": ("coherent", "mean"), "doa": ("bartlett", "capon", "music", "esprit")}


@dataclass(frozen=True)
class Processing:
    """Settings of the receiver, as the table [processing] of a scene file.

    Pairs are (along range, along range rate). Raises: ValueError for settings that cannot be.

    >>> Processing(range_window="taylor(40)", min_snr_db=15.0).pad
    (2, 2)
    """

    range_window: str = "hann"
    """Name of a window of `raychan.radar.windows`."""
    rate_window: str = "hann"
    pad: tuple[int, int] = (2, 2)
    """Zero padding, as a multiple of samples and of chirps."""
    cfar: str = "os"
    """Detector: 'ca' cell averaging, 'os' ordered statistic."""
    pfa: float = 1e-7
    """Probability of false alarm of a single cell of the map, detector alone: per resolution cell some 1.5 ('os') to 2
    times ('ca') this with Hann windows and a pad of (2, 2), for several cells hold one; see docs/theory.md."""
    min_snr_db: float = 20.0
    """Least signal-to-noise ratio that is reported [dB]."""
    guard: tuple[int, int] | None = None
    """Guard cells to each side of the cell under test; None: the detector's choice. Training cells are every second
    resolution cell, so that 0 and 1 are the same, as are 2 and 3."""
    train: tuple[int, int] | None = None
    """Training cells to each side beyond the guard; None: the detector's choice."""
    beams: str = "coherent"
    """Of several receivers: 'coherent' detects in the strongest of a bank of beams, 'mean' in their mean power."""
    doa: str = "bartlett"
    """Directions of echoes: 'bartlett', 'capon', 'music' or 'esprit'."""
    beam_window: str = "rect"
    """Taper of the detector's beams over a uniform line or rectangle of receivers."""

    def __post_init__(self) -> None:
        for name in ("range_window", "rate_window", "beam_window"):
            value = getattr(self, name)
            if not is_one_of(value, ("rect", "hann")):  # others need scipy to be checked
                from raychan.radar.windows import check_window

                check_window(f"Processing.{name}", value)
        for name, words in _WORDS.items():
            value = getattr(self, name)
            if not is_one_of(value, words):
                allowed = f"{', '.join(map(repr, words[:-1]))} or {words[-1]!r}"
                raise ValueError(f"Processing.{name} = {shown(value)}: must be {allowed}{meant(value, words)}")
        check_declared(Processing, vars(self))
        if not 0.0 < self.pfa < 1.0:
            raise ValueError(f"Processing.pfa = {self.pfa!r}: must lie between 0 and 1")
        for name, least in (("pad", 1), ("guard", 0), ("train", 0)):
            pair = getattr(self, name)
            if pair is None and name != "pad":
                continue
            two = isinstance(pair, Sequence | np.ndarray) and np.ndim(pair) > 0 and len(pair) == 2
            if not (two and all(is_whole(n) and n >= least for n in pair)):
                raise ValueError(f"Processing.{name} = {shown(pair)}: must be two whole numbers of at least {least}")
            object.__setattr__(self, name, tuple(int(plain(n)) for n in pair))
