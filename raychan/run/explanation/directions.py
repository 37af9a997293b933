"""What a radar's receivers tell of directions beyond its detections: the range-azimuth map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.blas import on_one_blas_thread
from raychan.parallel import parallel_tasks
from raychan.processing.cfar import batches
from raychan.processing.range_azimuth import RangeAzimuth
from raychan.processing.range_azimuth import range_azimuth as from_map
from raychan.radar.declared import check_type
from raychan.radar.radar import Radar
from raychan.radar.waveform import OwnWaveform
from raychan.records import Cube, Detections, Paths, RangeDoppler
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.receiver import aperture_of, check_cube, check_map, map_of, receivers
from raychan.run.receiver_losses import range_spread
from raychan.run.result import Receiver, Result
from raychan.signal.fronts import fronts_of
from raychan.units import C0

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Complexes = NDArray[np.complex128]

_AT_ONCE = 32  # as many times fewer paths pass a beam at a time as memory holds, so that threads share them
_LITTLE = 1e-3  # of a detection's amplitude: largest sum of the paths left out of a beam (not measured)
_ALIKE = 0.1  # range cells between middle and outermost element: below, a response differs by 0.06 dB at most
_BETWEEN = 0.5  # range cells between shifts of a beam's waves (with _SLIGHT within 1e-3 of an amplitude)
_SLIGHT = 1e-4  # of the largest singular value: smaller ones of the shifts' waves are left out
_NOTHING = 1e-9  # of a response at its peak
UNEXPLAINED = 0.1  # a cell is noise if its paths give less than this share of its power (not measured)
_OTHER = 30.0  # times a detection's power: paths at the middle that bring more are of another echo (not measured)


@on_one_blas_thread
def range_azimuth(data: Cube | RangeDoppler, radar: Radar) -> RangeAzimuth:
    """Return the range-azimuth map of samples or of a range-Doppler map, of all range rates the strongest.

    Args: data, a Cube or a RangeDoppler with all receivers; radar that recorded it, with its `processing`.
    Raises: ValueError where the radar's receivers measure no azimuth, or samples are not as many as it
    records, or a map is of other antennas or cells.
    """
    check_type("data", data, Cube, RangeDoppler)
    if isinstance(data, Cube):
        check_cube(data, radar)
    else:
        check_map(data, radar)
    rdmap = map_of(data, radar, radar.processing) if isinstance(data, Cube) else data
    return from_map(rdmap, receivers(radar), C0 / radar.waveform.middle, radar.processing.beam_window)


def angles_in(result: Result) -> RangeAzimuth | None:
    """Return the range-azimuth map of a result; None where its receivers measure no azimuth or are not known."""
    radar = result.scene.radar if result.scene is not None else None
    if radar is None or not aperture_of(radar).scans[0]:
        return None
    # Kept: it is written and drawn, and takes a second for 32 receivers.
    if "angles" not in result.__dict__:
        result.__dict__["angles"] = range_azimuth(result.rdmap, radar)
    found: RangeAzimuth = result.__dict__["angles"]
    return found


@dataclass(frozen=True)
class Beams:
    """The beams of an array in which its detections are seen, with nulls towards the others of their cells."""

    passed: Callable[[int, Ints, Bools], Complexes]
    """What the beam of a detection (row) passes of paths (n,), rows of all, as factors of their waves (n, k), so many
    `shifts` farther; of some, as told, it sees the mirror images of real sampling."""
    spread: Floats
    """Range cells (d,) by which the range of each detection differs over the array."""
    shifts: Floats
    """By how much (k,) [m] farther elements may see a path."""


def beam_to(radar: Radar, found: Detections, paths: Paths) -> Beams | None:
    """Return the beams of detections; None without an array, or where a file does not hold them."""
    if not found.beam.shape[1]:
        return None
    shifts, share, split = _shifts(radar)
    turns, fronts = 2.0 * np.pi * (radar.waveform.middle + share * radar.waveform.bandwidth) / C0, fronts_of(paths)
    senders, receivers = radar.tx_elements @ radar.axes.T, radar.elements @ radar.rx_axes.T

    def passed(row: int, some: Ints, mirrored: Bools) -> Complexes:
        waves, weights = fronts[some], found.beam[row].reshape(-1, len(receivers)).T.astype(np.complex64)
        sign, beam = np.where(mirrored, -1, 1), np.empty((len(some), len(shifts)), complex)
        parts = batches(len(some), _AT_ONCE * len(receivers))

        def one(k: int) -> None:
            part = parts[k]
            off = sign[part] * paths.range_rate[some[part]] - found.rate[row]
            whole = np.stack([in_beam(part, off, turn) for turn in turns], axis=1)
            # The little that is left of an echo in slots of another rate is none of a detection at that rate.
            leak = _folded(radar, off) & ((np.abs(whole) ** 2).max(axis=1) * _OTHER < 1.0)
            beam[part] = np.where(leak[:, None], 0.0, whole @ split)

        def in_beam(part: slice, off: Floats, turn: float) -> Complexes:
            # An image is the conjugate of its path, at minus its rate; so is what it brings to a cell.
            image = mirrored[part, None]
            sent, seen = (
                np.where(image, x.conj(), x)
                for x in (
                    _at_elements(waves.tx_radius[part], waves.departure[part], senders, turn),
                    _at_elements(waves.radius[part], waves.arrival[part], receivers, turn),
                )
            )
            held = (_in_slots(radar, weights.shape[1], sent, off, sign[part]) * (seen @ weights)).sum(axis=1)
            return np.asarray(np.where(mirrored[part], held.conj(), held))

        parallel_tasks(len(parts), one)
        return beam

    return Beams(passed, range_spread(found, radar)[0], shifts)


def _shifts(radar: Radar) -> tuple[Floats, Floats, Floats]:
    """Return by how much (k,) [m] farther elements may see an echo, at which shares (f,) of the sweep off its middle
    its waves are taken, and how they (f, k) make a wave at each shift: those of an echo at several elements turn over
    the sweep by how much farther it is there. One shift where that is of no account."""
    wave = radar.channel_waveform
    farthest = 0.5 * sum(float(np.linalg.norm(x, axis=1).max()) for x in (radar.tx_elements, radar.elements))
    cells = farthest / wave.range_resolution
    if cells < _ALIKE or radar.rx_position is not None or isinstance(wave, OwnWaveform):
        return np.zeros(1), np.zeros(1), np.ones((1, 1))
    at = np.linspace(-cells, cells, 3 + int(np.ceil(2.0 * cells / _BETWEEN)))
    share = 0.5 * np.cos(np.pi * (np.arange(2 * len(at)) + 0.5) / (2 * len(at)))
    turned = np.exp(-2j * np.pi * share[:, None] * at)
    return at * wave.range_resolution, share, np.linalg.pinv(turned, rcond=_SLIGHT).T


def _at_elements(radius: Floats, look: Floats, elements: Floats, turn: float) -> NDArray[np.complex64]:
    """Return the factors (n, e) at elements (e, 3) [m] of spherical waves from so far (n,) [m] along directions (n, 3),
    in phase and spreading, as `array.excess` tells them, but of all elements at once and in single precision."""
    far, along = radius.astype(np.float32)[:, None], look.astype(np.float32) @ elements.T.astype(np.float32)
    square = (elements**2).sum(axis=1).astype(np.float32)
    there = np.sqrt(np.maximum(far * (far - 2.0 * along) + square, 0.0))
    phase = np.float32(-turn) * (square - 2.0 * far * along) / np.maximum(there + far, np.float32(1e-30))
    found = np.empty(phase.shape, np.complex64)
    found.real, found.imag = np.cos(phase), np.sin(phase)
    # Where waves of a footprint's points cancel, what is left tells how much less of each is at farther elements.
    found *= np.divide(far, there, out=np.ones_like(there), where=there > 0.0)
    return found


def _folded(radar: Radar, off: Floats) -> Bools:
    """Return which paths (n,), whose rates are so far off [m/s] those for which transmitters are told apart, stand in
    other slots of Doppler division."""
    spacing = C0 / (2.0 * radar.waveform.middle * radar.waveform.repetition * radar.slots)
    return (radar.multiplexing == "ddm") & (np.abs(off) > 0.5 * spacing)


def _in_slots(radar: Radar, many: int, sent: Complexes, off: Floats, sign: Ints) -> Complexes:
    """Return what so many slots hold (n, s) of paths sent (n, t), whose rates are so far off (n,) [m/s] the rate for
    which the transmitters are told apart: by time division turned, by Doppler division, beyond half a fold, in other
    slots, of images, of sign -1 (n,), in those to the other side. Older files have beams of the transmitters' slots
    only."""
    wave, slots, count = radar.waveform, radar.slots, np.arange(many)
    turns = 2.0 * wave.middle / C0 * wave.repetition * off[:, None]  # a ramp
    if radar.multiplexing == "ddm":
        whose = sign[:, None] * (count + np.rint(turns * slots).astype(np.int64)) % slots
        held = np.take_along_axis(sent, np.minimum(whose, sent.shape[1] - 1), axis=1)
        return np.where(whose < sent.shape[1], held, 0.0)
    return sent * np.exp(-2j * np.pi * turns * count)


def wave_in_beam(
    paths: Paths,
    response: PointSpread,
    at: Floats,
    power: tuple[float, float],
    beams: Beams,
    row: int,
    receiver: Receiver,
) -> Complexes | None:
    """Return what an array's beam lets through of each path (n,) that may bring something to a detection, 0 of others;
    None where that does not explain it, but what arrives at the middle of the array does: the direction of an
    ambiguous detection may not be that of its echo. Paths that bring far more than it are of another echo of its cell.

    Args: at (3,) range [m], rate [m/s] and amplitude of the detection's peak in the map; power [W] of the cell and of
    the detection, a row of those that the beams are of."""
    place = paths.delay, paths.range_rate, float(at[0]), float(at[1])
    middle = response.in_cell(paths.amplitude, *place)[0]
    # Elements may see of a path what the middle hardly does.
    little = _LITTLE if len(beams.shifts) == 1 else _LITTLE**2
    near = _without_least(np.abs(middle), little * float(at[2]))
    wave, mirrored = np.zeros_like(paths.amplitude), _mirrored(paths, response, near, at)
    factor = _as_at_middle(paths, near, mirrored, response, at, beams.passed(row, near, mirrored), beams.shifts)
    wave[near] = paths.amplitude[near] * factor
    seen = response.in_cell(wave, *place)[0].sum()
    # What leaks into slots of another rate is no echo of this detection, at whatever place.
    middle[near[wave[near] == 0.0]] = 0.0
    brought = complex(middle.sum())
    other = unexplained(seen, power[1], receiver) and not unexplained(brought, power[0], receiver)
    other = other and abs(brought) ** 2 * receiver.power <= _OTHER * power[1]
    return None if other else wave


def _as_at_middle(
    paths: Paths, some: Ints, mirrored: Bools, response: PointSpread, at: Floats, passed: Complexes, shifts: Floats
) -> Complexes:
    """Return factors (n,) on waves of paths, rows `some` of all, at the middle of an array for what its beam sees of
    them, which `passed` (n, k) tells by shifts (k,) [m] of their ranges: the response of the map differs by these.

    Args: mirrored (n,) which are seen by their mirror images; at, range [m] and rate [m/s] of the cell."""
    if len(shifts) == 1:
        return passed[:, 0]
    found = np.zeros(len(some), complex)
    for image in np.unique(mirrored):
        sign, rows = (-1.0 if image else 1.0), np.flatnonzero(mirrored == image)
        delay, rate = paths.delay[some[rows]], paths.range_rate[some[rows]]
        cells = [(sign * float(at[0]) - float(off), sign * float(at[1])) for off in (0.0, *shifts)]
        one = np.ones(len(rows), complex)
        middle, *there = (response.image_in_cell(one, delay, rate, *cell)[0] for cell in cells)
        # Where the middle sees nothing of a path, no factor on it makes what elements see.
        seen = np.abs(middle) > _NOTHING
        whole = (passed[rows] * np.stack(there, axis=1)).sum(axis=1)
        found[rows] = np.where(seen, whole / np.where(seen, middle, 1.0), 0.0)
    return found


def _without_least(size: Floats, least: float) -> Ints:
    """Return the rows of sizes (n,), in order, without the smallest ones, whose sum is at most `least`."""
    order = np.argsort(size, kind="stable")
    return np.sort(order[np.cumsum(size[order]) > least])


def _mirrored(paths: Paths, response: PointSpread, some: Ints, at: Floats) -> Bools:
    """Return which paths, rows of all (n,), a cell shows by their mirror images. Args: at, range [m] and rate [m/s]."""
    if not response.mirrors:
        return np.zeros(len(some), bool)
    given = paths.amplitude[some], paths.delay[some], paths.range_rate[some]
    own, image = (np.abs(response.image_in_cell(*given, s * float(at[0]), s * float(at[1]))[0]) for s in (1.0, -1.0))
    return np.asarray(image > own)


def unexplained(wave: complex, power: float, receiver: Receiver) -> bool:
    """Return whether paths give too little of a power [W] to explain it. Args: wave, the sum of what they bring."""
    return bool(abs(wave) ** 2 * receiver.power < UNEXPLAINED * power)
