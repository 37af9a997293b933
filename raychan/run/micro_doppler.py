"""Micro-Doppler: a frame in which bodies turn, from as few tracings as its error allows.

The scene is traced at some chirps. Between two of them the routes of both are carried on as their bodies turn (see
channel.advance) and their samples are blended from one to the other. Another tracing is put in the middle as long as
the two differ by more than the tolerance; what they differ by is the stated error.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.paths import join
from raychan.channel.slow_time import Poses, carried, strengths
from raychan.channel.transfer import departures
from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.records import DIFFRACT, Paths, Routes
from raychan.run.segments import Keyframe, Retraced, Segment, Traced, echoes, joined, reach
from raychan.run.solver import Batch, solve_into
from raychan.signal.baseband import synthesize
from raychan.signal.dechirp import ramp_sums
from raychan.tracing.settings import PruneRule
from raychan.units import C0
from raychan.world.geometry import geometry_of, surface_at
from raychan.world.scene import Scene

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Samples = NDArray[np.complexfloating[Any, Any]]

_CHIRPS = 48  # at most one more tracing for so many chirps
_AT_ONCE = 64  # chirps whose routes are held at once
_FEW = 3_000_000  # samples times parts of routes up to which the plain sum is faster than a transform
_HELPS = 0.5  # share of the power of error that may be left by a tracing in between if it is to help
_NEEDED = 1.0  # rad of bend over a frame from which `auto` traces again


def turning(scene: Scene) -> NDArray[np.bool_]:
    """Return which bodies (b,) turn."""
    return np.array([b.motion.spin().any() for b in scene.bodies], bool)


def moving(scene: Scene) -> NDArray[np.bool_]:
    """Return which bodies (b,) turn or move relative to the radar."""
    own = np.asarray(scene.radar.velocity, float)
    return turning(scene) | np.array([not np.array_equal(b.motion.velocity, own) for b in scene.bodies], bool)


def bend(scene: Scene, edge: float) -> float:
    """Return the phase [rad] that paths at their rates leave out over a frame: along the turn of a body's outermost
    point, and across a tube of a given edge [m]."""
    wave, worst = scene.radar.waveform, 0.0
    k, half = 4.0 * np.pi / wave.wavelength, 0.5 * wave.frame_duration
    for body in (b for b, t in zip(scene.bodies, turning(scene), strict=True) if t):
        rate = float(np.linalg.norm(body.motion.spin()))
        vertices = body.geometry.vertices
        radius = float(
            np.linalg.norm(np.cross(body.motion.rotation().T @ body.motion.spin() / rate, vertices), axis=1).max()
        )
        size = float(np.ptp(vertices, axis=0).max())
        worst = max(worst, k * radius * (rate * half) ** 2 / 2.0, k * min(edge, size) * rate * half)
    return worst


def needed(scene: Scene, retrace: str | int, edge: float) -> bool:
    """Tell whether a frame is to be traced more than once."""
    if retrace == 1 or scene.radar.waveform.n_chirps < 3:
        return False
    return bend(scene, edge) > _NEEDED if retrace == "auto" else bool(moving(scene).any())


def retraced(
    scene: Scene,
    rule: PruneRule,
    model: Any,
    first: Traced | None = None,
    progress: Callable[[float], None] | None = None,
) -> Retraced:
    """Return the samples of a frame in which bodies turn.

    Args: rule by which each tracing is pruned, from where the radar is then; model the scene's, whose `retrace` is
    "auto" or the number of tracings, when bodies that only move are carried on too; first the paths at the frame's
    start, if they are known; progress is told the share done.
    """
    work = _Work(scene, rule, model, progress)
    last = scene.radar.waveform.n_chirps - 1
    if model.retrace == "auto":
        return work.adaptive(last, first)
    return work.even(last, first, int(model.retrace))


class _Work:
    """One frame being put together."""

    def __init__(self, scene: Scene, rule: PruneRule, model: Any, progress: Callable[[float], None] | None) -> None:
        self.scene, self.rule, self.model, self.progress = scene, rule, model, progress
        self.turns = turning(scene) if model.retrace == "auto" else moving(scene)
        self.radar: Radar = dataclasses.replace(scene.radar, noise=False)
        wave = self.radar.waveform
        self.chirps, self.step = wave.n_chirps, wave.repetition
        self.rays, self.times = 0, list[float]()
        self.most = max(3, 1 + self.chirps // _CHIRPS)
        self.reached = True

    def adaptive(self, last: int, first: Traced | None) -> Retraced:
        """Return the frame with tracings put where those on both sides differ by more than the tolerance."""
        keys = [self.key(0, first), self.key(last // 2), self.key(last)]
        pieces = [self.piece(a, b) for a, b in pairwise(keys)]
        power = sum(float((np.abs(p.blend()[0]) ** 2).sum()) for p in pieces) / self.chirps
        limit = power * (10.0 ** (self.model.tolerance_db / 20.0) - 1.0) ** 2
        # What each piece may be wrong by for a chirp, and what one twice as long was.
        known = [(p, p.off(), np.inf) for p in pieces]
        while len(self.times) < self.most:
            worst = max((k for k in known if _worth(*k, limit)), key=lambda k: k[1] * k[0].chirps, default=None)
            if worst is None:
                break
            known.remove(worst)
            known += [(half, half.off(), worst[1]) for half in self.halves(worst[0])]
        self.reached = all(off <= limit for _, off, _ in known)
        return self.done(sorted((p for p, _, _ in known), key=lambda p: p.start.chirp))

    def halves(self, piece: Segment) -> tuple[Segment, Segment]:
        """Return a piece in two, with a tracing in its middle."""
        start, end = piece.start, piece.end
        key = self.key((start.chirp + end.chirp) // 2)
        left, right = reach(key.chirp - start.chirp), reach(end.chirp - key.chirp)
        c = self.carried(key, key.chirp - left, key.chirp + right)
        return (
            Segment(start, key, piece.a[:, :, : left + 1], c[:, :, : left + 1]),
            Segment(key, end, c[:, :, left:], piece.b[:, :, -right - 1 :]),
        )

    def even(self, last: int, first: Traced | None, count: int) -> Retraced:
        """Return the frame from `count` tracings evenly spread."""
        at = np.unique(np.rint(np.linspace(0, last, count)).astype(int))
        keys = [self.key(int(c), first if c == 0 else None) for c in at]
        return self.done([self.piece(a, b) for a, b in pairwise(keys)])

    def piece(self, start: Keyframe, end: Keyframe) -> Segment:
        """Return the chirps between two tracings."""
        far = reach(end.chirp - start.chirp)
        a = self.carried(start, start.chirp, start.chirp + far)
        return Segment(start, end, a, self.carried(end, end.chirp - far, end.chirp))

    def done(self, pieces: list[Segment]) -> Retraced:
        """Return the frame of pieces in order."""
        samples, error = joined([p.blend() for p in pieces]), joined([p.doubt() for p in pieces])
        if not self.radar.waveform.complex_sampling:
            samples, error = samples.real.astype(complex), error.real.astype(complex)
        times = tuple(sorted(self.times))
        return Retraced(samples.sum(axis=0), samples[0], self.turns, error.sum(axis=0), times, self.rays, self.reached)

    def key(self, chirp: int, known: Traced | None = None) -> Keyframe:
        """Trace the scene at a chirp."""
        now = self.scene.at(chirp * self.step)
        self.times.append(chirp * self.step)
        carrier = self.radar.waveform.carrier
        geometry = surface_at(now) if known is None else geometry_of(now)
        if known is None:
            found: list[Batch] = []
            parts: list[Paths] = []
            rule = dataclasses.replace(self.rule, position=np.asarray(now.radar.position, float))
            stats = solve_into(parts.append, geometry, now.points(), now.radar, carrier, rule, keep=found.append)
            self.rays += stats.rays
            known = Traced(join(parts), tuple(found))
        turned = [take(r, self.touches(r.body, r.kind)) for r in known.routes if isinstance(r, Routes)]
        routes = tuple(r for r in turned if len(r.kind))
        ways = known.paths.ways
        rest = ~self.touches(ways.body, ways.kind) | (ways.kind == DIFFRACT).any(axis=1)
        if self.progress:
            self.progress(len(self.times) / self.most)
        return Keyframe(
            chirp,
            now,
            routes,
            tuple(strengths(r, geometry.facets, now.radar, carrier) for r in routes),
            take(known.paths, rest[known.paths.way]),
        )

    def touches(self, body: NDArray[np.signedinteger], kind: NDArray[np.signedinteger]) -> NDArray[np.bool_]:
        """Tell which chains (n, d) meet a turning body."""
        return np.asarray((self.turns[np.maximum(body, 0)] & (kind > 0)).any(axis=1))

    def carried(self, key: Keyframe, first: int, last: int) -> Samples:
        """Return the samples (2, antenna, chirp, sample) of a tracing's paths carried over chirps first to last: those
        that meet turning bodies, all others."""
        wave = self.radar.waveform
        shape = (2, len(self.radar.elements), last - first + 1, wave.n_samples)
        out = np.zeros(shape, np.complex64)
        growth = key.others.length_rate / C0 * (first - key.chirp) * self.step
        late = key.others.replace(
            length=key.others.length + C0 * growth,
            amplitude=key.others.amplitude * np.exp(-2j * np.pi * wave.carrier * growth),
        )
        frame = dataclasses.replace(wave, n_chirps=last - first + 1)
        out[1] = synthesize(late, dataclasses.replace(self.radar, waveform=frame)).samples
        for routes, strength in zip(key.routes, key.strengths, strict=True):
            # A receiver moved towards the arriving wave has a shorter path.
            nearer = departures(routes)[1] @ self.radar.elements_world.T
            for start in range(first, last + 1, _AT_ONCE):
                count = min(_AT_ONCE, last + 1 - start)
                # One instant more than chirps: growth from chirp to chirp is what a path's rate is.
                poses = self.poses(key, np.arange(start, start + count + 1))
                lengths, amplitudes = carried(routes, strength, poses, wave.carrier)
                rows = slice(start - first, start - first + count)
                for layer, near in zip(out[0], nearer.T, strict=True):
                    layer[rows] += self.ramps(lengths - near[:, None], amplitudes * self.turn(near)[:, None])
        return out

    def turn(self, nearer: Floats) -> Complexes:
        """Return the carrier's turn and the transmitted amplitude [sqrt(W)] of ways shorter by [m]."""
        wave = self.radar.waveform
        return np.asarray(np.sqrt(self.radar.power) * np.exp(2j * np.pi / wave.wavelength * nearer))

    def ramps(self, lengths: Floats, amplitudes: Complexes) -> Samples:
        """Return the samples (chirp, sample) of parts (chirp + 1, n, 3) of routes with these lengths [m]."""
        wave, count = self.radar.waveform, len(lengths) - 1
        parts = np.flatnonzero((amplitudes != 0.0).any(axis=0))
        length = lengths.reshape(count + 1, -1)[:, parts]
        delay = length / C0
        growth, delay = np.diff(delay, axis=0) / self.step, delay[:-1]
        strength = amplitudes.reshape(count + 1, -1)[:-1, parts]
        if len(parts) * wave.n_samples <= _FEW:
            step = wave.chirp_duration / wave.n_samples
            rows = ramp_sums(strength, delay, growth, wave.carrier, wave.slope, step, wave.n_samples)
            return np.asarray(rows)
        here = np.zeros(3)
        one = dataclasses.replace(
            self.radar, elements=here[None], power=1.0, waveform=dataclasses.replace(wave, n_chirps=1)
        )
        return np.stack(
            [
                synthesize(echoes(*row, here), one).samples[0, 0]
                for row in zip(length[:-1], strength, growth, strict=True)
            ]
        )

    def poses(self, key: Keyframe, chirps: NDArray[np.signedinteger]) -> Poses:
        """Return where bodies and radar are at chirps, as seen from a tracing."""
        late = (chirps - key.chirp) * self.step
        motions, radar = [b.motion for b in key.scene.bodies], key.scene.radar
        turn = np.broadcast_to(np.eye(3), (len(late), len(motions), 3, 3)).copy()
        for b in np.flatnonzero(self.turns):
            turn[:, b] = [motions[b].rotation(t) @ motions[b].rotation().T for t in late]
        origin, velocity = (np.array([f(m) for m in motions]) for f in (lambda m: m.origin(), lambda m: m.velocity))
        return Poses(
            origin=origin,
            turn=turn,
            place=origin + late[:, None, None] * velocity,
            radar=radar.position + late[:, None] * radar.velocity,
        )


def _worth(piece: Segment, off: float, before: float, limit: float) -> bool:
    """Tell whether a tracing in the middle of a piece may help: where half the distance did not, launches differ."""
    return off > limit and off <= _HELPS * before and piece.chirps >= 5
