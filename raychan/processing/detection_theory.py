"""What a detector is worth: probability of detection against SNR in closed form, fluctuating targets and CFAR included.

A look is the power of one sample of a target in complex Gaussian noise; `looks` of them add without phase, as the
powers of receivers do in a map cell. SNR is that of one look, averaged over the target's fluctuation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammainc, gammaincc, gammainccinv, gammaln

from raychan.processing.cfar import METHODS, factor, quantiles_of
from raychan.radar.declared import check_type, reals
from raychan.scalars import is_number, is_one_of, plain, shown
from raychan.units import db, undb

Floats = NDArray[np.float64]

SWERLING = (0, 1, 2, 3, 4)
_TINY = 1e-300
_MOST_CELLS = 1e18  # training cells: their mean is that of the noise to 1e-9, and `cfar` None says the same
_MOST_LOOKS = 1_000_000
_MOST_DB = 300.0  # dB: as the most that a scene file takes
_SURE = 1e4  # times the threshold: the normal deviate of a miss is then below -100
_NEGLIGIBLE = 12.0  # standard deviations of a gamma variable beyond which its tail is under 1e-15 of a probability


@dataclass(frozen=True)
class Detector:
    """A detector: its probability of false alarm, and how it learns the noise.

    >>> round(float(detection_probability(13.0, Detector(pfa=1e-6))), 3)
    0.874
    """

    pfa: float = 1e-7
    """Probability of false alarm of a single cell of the map, see `Processing.pfa`."""
    looks: int = 1
    """Powers added in a cell."""
    cfar: str | None = None
    """'ca', 'os', or None for a threshold over known noise."""
    cells: float = np.inf
    """Effective number of independent training cells (`processing.cfar.Training.worth`), only with `cfar`."""
    min_snr_db: float = -np.inf
    """Least power over the known noise that is reported [dB]."""

    def __post_init__(self) -> None:
        for name, kind in (("pfa", float), ("looks", int)):
            check_type(f"Detector.{name}", getattr(self, name), kind)
            object.__setattr__(self, name, kind(plain(getattr(self, name))))
        for name in ("cells", "min_snr_db"):
            if not is_number(getattr(self, name)):
                raise ValueError(f"Detector.{name} = {shown(getattr(self, name))}: a number is wanted")
            object.__setattr__(self, name, float(plain(getattr(self, name))))
        if not 0.0 < self.pfa < 1.0:
            raise ValueError(f"Detector.pfa = {self.pfa!r}: must lie between 0 and 1")
        if not 1 <= self.looks <= _MOST_LOOKS:
            raise ValueError(f"Detector.looks = {self.looks!r}: must be a whole number from 1 on, to {_MOST_LOOKS:,}")
        if not (self.cfar is None or is_one_of(self.cfar, METHODS)):
            raise ValueError(f"Detector.cfar = {shown(self.cfar)}: must be None or one of {', '.join(METHODS)}")
        if not self.min_snr_db <= _MOST_DB:
            raise ValueError(f"Detector.min_snr_db = {self.min_snr_db!r}: must be a number, at most {_MOST_DB:g} dB")
        if self.cfar is not None and not 1.0 <= self.cells <= _MOST_CELLS:
            raise ValueError(f"Detector.cells = {self.cells!r}: a CFAR needs 1 to {_MOST_CELLS:g} training cells")
        if not self.cells >= 1.0:
            raise ValueError(f"Detector.cells = {self.cells!r}: must be 1 or more")
        if self.cfar is None and self.cells <= _MOST_CELLS:
            raise ValueError(f"Detector.cells = {self.cells!r}: only with cfar = 'ca' or 'os', which learn the noise")


def shape_of(swerling: int, looks: int = 1) -> float:
    """Return the shape of the gamma distribution of a target's RCS summed over its looks; infinite for a steady one.

    Raises: ValueError on an unknown case. Source: Shnidman 2003 (IEEE Trans. AES 39): 1, N, 2, 2N.
    """
    check_type("swerling", swerling, int)
    if swerling not in SWERLING:
        raise ValueError(f"swerling = {swerling!r}: must be one of 0, 1, 2, 3, 4")
    return (np.inf, 1.0, float(looks), 2.0, 2.0 * looks)[int(swerling)]


def over_threshold(snr: ArrayLike, threshold: ArrayLike, looks: int = 1, swerling: int = 0) -> Floats:
    """Return the probability that the sum of `looks` powers exceeds a threshold; both broadcast.

    Args: snr of one look (power ratio); threshold relative to the mean noise power of one look.
    Source: Swerling 1960; a gamma-distributed RCS makes the sum a negative binomial mixture of gamma variables
    (Shnidman 2003); a steady one gives Marcum's Q function.
    """
    s, t = np.broadcast_arrays(np.asarray(snr, float), np.asarray(threshold, float))
    shape = shape_of(swerling, looks)
    if np.isinf(shape):
        from scipy.stats import ncx2  # takes long to import, and most runs need none of it

        # Beyond, the library's series fails, and nothing is missed any more.
        sure = looks * s > _SURE * (t + 1.0)
        steady = ncx2.sf(2.0 * t, 2 * looks, 2.0 * looks * np.where(sure, 1.0, np.maximum(s, _TINY)))
        steady = np.where(sure, 1.0, steady)
        return np.asarray(np.where(s > 0.0, steady, gammaincc(looks, t)))
    # The missed share: terms vanish where looks + j is far above the threshold.
    top = float(t.max(initial=0.0))
    j = np.arange(int(top + _NEGLIGIBLE * np.sqrt(top + looks) + 50.0))
    mean = np.maximum(looks * s / shape, _TINY)[..., None]
    log_weight = gammaln(j + shape) - gammaln(shape) - gammaln(j + 1.0) - shape * np.log1p(mean)
    log_weight = log_weight + j * (np.log(mean) - np.log1p(mean))
    missed = (np.exp(log_weight) * gammainc(looks + j, t[..., None])).sum(axis=-1)
    return np.asarray(np.clip(1.0 - missed, 0.0, 1.0))


def detection_probability(snr_db: ArrayLike, detector: Detector = Detector(), swerling: int = 0) -> Floats:
    """Return the probability of detection of a target of a mean SNR per look [dB], any shape.

    A CFAR's threshold follows its training statistic, over whose distribution the probability is averaged.
    Raises: ValueError on another type or an unknown Swerling case. Source: Rohling 1983; Gandhi & Kassam 1988 for one
    look of case 1; any other case by the same average.
    """
    check_type("detector", detector, Detector)
    if np.isnan(reals("snr_db", snr_db)).any():
        raise ValueError("snr_db: holds NaN")
    # Beyond 250 dB nothing but the RCS itself decides, and squares overflow.
    snr, looks = np.asarray(undb(np.minimum(np.asarray(snr_db, float), 250.0))), int(detector.looks)
    if detector.cfar is None:
        return over_threshold(snr, _threshold(detector), looks, swerling)
    quantiles, weights = quantiles_of(detector.cells, detector.cfar, looks)
    scale = factor(detector.pfa, detector.cells, detector.cfar, looks)
    thresholds, index = np.unique(np.maximum(scale * quantiles, _least(detector)), return_inverse=True)
    shares = np.bincount(index, weights)
    return np.asarray(sum(w * over_threshold(snr, t, looks, swerling) for t, w in zip(thresholds, shares, strict=True)))


def _least(detector: Detector) -> float:
    """Return the least sum of powers that is reported, relative to the mean noise power of a look."""
    return float(detector.looks * undb(detector.min_snr_db))


def _threshold(detector: Detector) -> float:
    """Return the threshold of the sum of powers over known noise."""
    return max(float(gammainccinv(detector.looks, detector.pfa)), _least(detector))


def albersheim(pd: ArrayLike, pfa: float = 1e-7, looks: int = 1) -> Floats:
    """Return the SNR per look [dB] at which a steady target is detected with probability `pd`.

    Within 0.33 dB of the exact curves for pd 0.4 to 0.95, pfa 1e-7 to 1e-3 and 1 to 100 looks; 4 dB too low at pd 0.1
    and pfa 1e-3. Raises: ValueError where pd is not between 0 and 1. Source: Albersheim 1981 (Proc. IEEE 69, p. 839).
    """
    p = _proper(pd)
    a, b = np.log(0.62 / pfa), np.log(p / (1.0 - p))
    argument = a + 0.12 * a * b + 1.7 * b
    return np.asarray(-5.0 * np.log10(looks) + (6.2 + 4.54 / np.sqrt(looks + 0.44)) * np.log10(argument))


def shnidman(pd: ArrayLike, pfa: float = 1e-7, looks: int = 1, swerling: int = 0) -> Floats:
    """Return the SNR per look [dB] at which a target of a Swerling case is detected with probability `pd`.

    Within 0.5 dB of the exact curves for pd 0.2 to 0.9, pfa 1e-7 to 1e-5 and 1 to 100 looks.
    Raises: ValueError where pd is not between 0 and 1. Source: Shnidman 2002 (IEEE Trans. AES 38, p. 1059).
    """
    p, share = _proper(pd), 1.0 / shape_of(swerling, looks)
    edge = np.sqrt(-0.8 * np.log(4.0 * p * (1.0 - p))) * np.sign(p - 0.5)
    eta = np.sqrt(-0.8 * np.log(4.0 * pfa * (1.0 - pfa))) + edge
    more = 0.0 if looks < 40 else 0.25
    steady = eta * (eta + 2.0 * np.sqrt(0.5 * looks + (more - 0.25)))
    low = (((17.7006 * p - 18.4496) * p + 14.5339) * p - 3.525) * share
    high = np.exp(27.31 * p - 25.14) + (p - 0.8) * (0.7 * np.log(1e-5 / pfa) + (2.0 * looks - 20.0) / 80.0)
    return np.asarray(db(steady / looks) + low + np.where(p > 0.872, high * share, 0.0))


def _proper(pd: ArrayLike) -> Floats:
    p = np.asarray(pd, float)
    if not ((p > 0.0) & (p < 1.0)).all():
        raise ValueError(f"pd = {pd!r}: must lie between 0 and 1")
    return p


def fluctuation(swerling: int, looks: int, draws: int, rng: np.random.Generator) -> Floats:
    """Return RCS factors (draws, looks) of mean 1 of a target: equal over the looks of a draw in cases 1 and 3,
    independent in 2 and 4, exponential in 1 and 2, chi-square of four degrees in 3 and 4. Source: Swerling 1960."""
    shape_of(swerling)
    if swerling == 0:
        return np.ones((draws, looks))
    shape = 1.0 if swerling < 3 else 2.0
    size = (draws, 1) if swerling in (1, 3) else (draws, looks)
    return np.broadcast_to(rng.gamma(shape, 1.0 / shape, size), (draws, looks))


def simulated(snr_db: float, detector: Detector, swerling: int, draws: int, rng: np.random.Generator) -> float:
    """Return the share of `draws` of a cell, and of training cells where there is a CFAR, in which a target of a mean
    SNR per look [dB] is detected: the second way to `detection_probability`, by noise instead of formulas."""
    looks, count = int(detector.looks), round(detector.cells) if detector.cfar else 0
    voltage = np.sqrt(float(undb(snr_db)) * fluctuation(swerling, looks, draws, rng))
    noise = rng.standard_normal((draws, looks, 2)) * np.sqrt(0.5)
    power = ((voltage + noise[..., 0]) ** 2 + noise[..., 1] ** 2).sum(axis=1)
    if detector.cfar is None:
        return float((power > _threshold(detector)).mean())
    train = rng.gamma(looks, 1.0, (draws, count))
    rank = max(1, count // 2) - 1
    level = train.mean(axis=1) if detector.cfar == "ca" else np.partition(train, rank, axis=1)[:, rank]
    scale = factor(detector.pfa, count, detector.cfar, looks)
    return float((power > np.maximum(scale * level, _least(detector))).mean())
