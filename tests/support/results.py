"""Small records for tests, made without tracing."""

from __future__ import annotations

import dataclasses
import operator

import numpy as np

from raychan.radar.waveform import Waveform
from raychan.records import Cube, Detections, MapError, Paths, Profile, RangeDoppler
from raychan.run.explanation.labels import provenance
from raychan.run.ledger_entry import Entry
from raychan.run.result import ExplainedDetections, Receiver, Result

WAVE = Waveform(
    carrier=77e9,
    bandwidth=1e9,
    chirp_duration=30e-6,
    repetition=40e-6,
    n_chirps=64,
    n_samples=128,
    complex_sampling=True,
)
BODIES = ("ground", "suv", "truck", "walker")
PARTS = ("", "tail", "")


def paths(ranges, rates, amplitudes, chains) -> Paths:
    """Paths by range [m], rate [m/s], amplitude and chain, a list of (body, kind)."""
    n = len(ranges)
    body = np.full((n, 4), -1)
    kind = np.zeros((n, 4), int)
    vertices = np.zeros((n, 4, 3))
    for i, chain in enumerate(chains):
        for j, (b, k) in enumerate(chain):
            body[i, j], kind[i, j] = b, k
            vertices[i, j] = (ranges[i], 0.1 * b, 0.5)
    forward = np.tile([1.0, 0.0, 0.0], (n, 1))
    return Paths.of(
        length=2.0 * np.asarray(ranges, float), amplitude=np.asarray(amplitudes, complex),
        length_rate=2.0 * np.asarray(rates, float), departure=forward, arrival=forward, body=body, kind=kind,
        part=np.where(body < 0, -1, np.isin(body, (1, 2))),
        vertices=vertices, body_names=BODIES, part_names=PARTS, tx=np.zeros(3), rx=np.zeros(3),
    )  # fmt: skip


def receiver(window: str = "hann") -> Receiver:
    """Return what is known of the receiver of `WAVE`, of one window in range and rate."""
    return Receiver(WAVE, window, window, power=1.0, ego_speed=7.0, background=("ground",))


def result(p: Paths, where, text: str = "", differ=0.01) -> Result:
    """Return a result whose map is empty but for its detections at `where`, rows of (range, rate, power).

    Two launches differ by the share `differ` of the power: one number, or one per detection.
    """
    where = np.asarray(where, float).reshape(-1, 3)
    ranges = np.arange(128) * WAVE.range_resolution
    rates = (np.arange(64) - 32) * WAVE.rate_resolution
    cells = [(int(np.argmin(abs(rates - v))), int(np.argmin(abs(ranges - r)))) for r, v, _ in where]
    power = np.full((64, 128), 1e-15)
    for cell, watt in zip(cells, where[:, 2], strict=True):
        power[cell] = watt
    n = len(where)
    found = Detections(
        range=where[:, 0], rate=where[:, 1], speed=where[:, 1] + 7.0, azimuth=np.full(n, np.nan),
        elevation=np.full(n, np.nan), ambiguous=np.zeros(n, bool), snr=np.full(n, 30.0), power=where[:, 2],
        cell=np.array(cells, int).reshape(-1, 2), beam=np.zeros((n, 0)),
    )  # fmt: skip
    spectrum = np.sqrt(power)[None].astype(np.complex64)
    rdmap = RangeDoppler(
        range=ranges, rate=rates, spectrum=spectrum, power=power, noise=1e-15, range_resolution=WAVE.range_resolution,
        rate_resolution=WAVE.rate_resolution, unambiguous_range=19.2, unambiguous_rate=24.3,
    )  # fmt: skip
    profile = Profile(
        range=ranges, power=power.max(axis=0), noise=1e-15, peaks=np.unique([c[1] for c in cells]).astype(int)
    )
    cube = Cube(samples=np.zeros((1, 64, 128), np.complex64), noise_power=1e-12)
    error = 0.01 * power
    for cell, share in zip(cells, np.broadcast_to(differ, n), strict=True):
        error[cell] = share * power[cell]
    why = provenance(p, rdmap, found, receiver(), error)
    return Result(
        p, profile, cube, rdmap, ExplainedDetections.of(found, why), why, receiver(), seed=3, timings={"trace": 0.5},
        error=MapError(power=error), ledger={"diffraction": Entry("unknown", "none", "")}, warnings=("a warning",),
        text=text,
        path="street.toml" if text else "",
    )  # fmt: skip


def assert_same(a: Result, b: Result) -> None:
    """Assert that all in two results that is random or measured is equal to the last bit."""
    for name in ("paths", "paths.trajectories", "profile", "cube", "rdmap", "error", "detections"):
        one, other = operator.attrgetter(name)(a), operator.attrgetter(name)(b)
        for f in dataclasses.fields(one):
            if f.name != "trajectories":
                x, y = getattr(one, f.name), getattr(other, f.name)
                np.testing.assert_array_equal(x, y, err_msg=f"{name}.{f.name}")
