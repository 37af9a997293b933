"""Micro-Doppler: the samples of a frame in which bodies turn, from as few tracings as the tolerance allows.

The scene is traced at some chirps, the keyframes. Between two of them the routes of both are extrapolated as their
bodies turn (see channel.slow_time), and the samples are blended from one to the other. Where the two differ by more
than the tolerance, another keyframe is traced in the middle; their difference is the stated error.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.paths import join
from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.records import DIFFRACT, Paths, Routes
from raychan.run.carried_ramps import MadeAgain
from raychan.run.segments import CarriedRoutes, Keyframe, Retraced, Segment, Traced, joined, reach
from raychan.run.smooth_ramps import SmoothRamps
from raychan.run.solver import Batch, solve_into
from raychan.run.turning import carried_on, middle_chirp
from raychan.tracing.joined_routes import joined as joined_routes
from raychan.tracing.settings import PruneRule
from raychan.world.geometry import geometry_of, surface_at
from raychan.world.scene import Scene

Samples = NDArray[np.complexfloating[Any, Any]]

# Trade time against error; single values not measured.
_CHIRPS = 48  # least chirps per keyframe: bounds the number of tracings
_ROUTES = 20_000  # carried on at once: memory against fewer sums; with 6,000 a crossing car takes 5.1 s, not 4.1
_HELPS = 0.5  # of the error power before: a keyframe that leaves more is the last one in its segment
_BETWEEN = 0.6e-3
"""From one computed pose to the next in a spectrogram [s]: a walker's samples are then off by -117 dB (0.3 ms:
-119, 1.2 ms: -111; the scene of `pytest tests/run/test_walker_frames.py -k poses`), in 1.1 to 1.2 of the time at ramps
0.1 ms apart. Footprints that drift apart between poses are computed at every chirp (run.between_chirps)."""


def retraced(
    scene: Scene,
    rule: PruneRule,
    model: Any,
    first: Traced | None = None,
    progress: Callable[[float], None] | None = None,
) -> Retraced:
    """Return the samples of a frame in which bodies turn.

    Args: rule by which each tracing is pruned, from where the radar is then; model the scene's, whose `retrace` is
    "auto" or the number of tracings (then bodies that only move are extrapolated too); first the paths of its
    middle, if they are known (see `run.instant`); progress is called with the share done.
    """
    work = _Frame(scene, rule, model, progress)
    last = scene.radar.waveform.n_chirps - 1
    if model.retrace == "auto":
        return work.adaptive(last, first)
    return work.even(last, first, int(model.retrace))


def carried_from_middle(
    scene: Scene,
    rule: PruneRule,
    model: Any,
    traced: Traced,
    turns: NDArray[np.bool_],
    progress: Callable[[float], None] | None = None,
) -> Retraced:
    """Return the samples of a frame that was traced once, at its middle, in which bodies pass so fast that constant
    rates do not hold: what meets these is carried on to both ends of the frame.

    Args: as of `retraced`; traced, the paths of its middle; turns, which bodies are carried on.
    """
    work = _Frame(scene, rule, model, progress)
    work.turns = work.carried.turns = turns
    work.most = 1
    return work.once(traced)


def stretches(
    scene: Scene, rule: PruneRule, model: Any, count: int, progress: Callable[[float], None] | None = None
) -> Iterator[tuple[Samples, Samples]]:
    """Yield the samples (antenna, chirp, sample) of a frame that is too long to be held, and their error, part by part.

    Args: as of `retraced`; count of tracings at equal distances; all that moves is carried on between them. A part
    begins with the chirp after the last one of the part before.
    """
    work = _Frame(scene, rule, model.model_copy(update={"retrace": count}), progress)
    work.most, work.carried.every = count, max(1.0, _BETWEEN / work.step)
    at = np.unique(np.rint(np.linspace(0, scene.radar.waveform.n_chirps - 1, count)).astype(int))
    before = work.keyframe(int(at[0]))
    for chirp in at[1:]:
        key = work.keyframe(int(chirp))
        part, first = work.segment(before, key), min(before.chirp, 1)
        yield part.blend().sum(axis=0)[:, first:], part.error().sum(axis=0)[:, first:]
        before = key


class _Frame:
    """One frame as it is assembled from keyframes."""

    def __init__(self, scene: Scene, rule: PruneRule, model: Any, progress: Callable[[float], None] | None) -> None:
        self.scene, self.rule, self.model, self.progress = scene, rule, model, progress
        self.turns = carried_on(scene, model.retrace)
        self.radar: Radar = dataclasses.replace(scene.radar, noise=False)
        wave = self.radar.waveform
        self.chirps, self.step = wave.n_chirps, wave.repetition
        self.carried = SmoothRamps(self.radar, self.turns)
        self.rays, self.times = 0, list[float]()
        self.most = max(3, 1 + self.chirps // _CHIRPS)
        self.reached = True

    def adaptive(self, last: int, first: Traced | None) -> Retraced:
        """Return the frame, with keyframes added where those on both sides differ by more than the tolerance."""
        keyframes = [self.keyframe(0), self.keyframe(middle_chirp(last + 1), first), self.keyframe(last)]
        segments = [self.segment(a, b) for a, b in pairwise(keyframes)]
        power = sum(float((np.abs(s.blend()[0]) ** 2).sum()) for s in segments) / self.chirps
        limit = power * (10.0 ** (self.model.tolerance_db / 20.0) - 1.0) ** 2
        # Each segment with its error power per chirp, and that of the segment it was split from.
        known = [(s, s.error_power(), np.inf) for s in segments]
        while len(self.times) < self.most:
            worst = max((k for k in known if _worth(*k, limit)), key=lambda k: k[1] * k[0].chirps, default=None)
            if worst is None:
                break
            known.remove(worst)
            known += [(half, half.error_power(), worst[1]) for half in self.halves(worst[0])]
        self.reached = all(error <= limit for _, error, _ in known)
        return self.done(sorted((s for s, _, _ in known), key=lambda s: s.start.chirp))

    def halves(self, segment: Segment) -> tuple[Segment, Segment]:
        """Return a segment split in two by a keyframe in its middle."""
        start, end = segment.start, segment.end
        key = self.keyframe((start.chirp + end.chirp) // 2)
        left, right = reach(key.chirp - start.chirp), reach(end.chirp - key.chirp)
        c = self.carried.both(key, key.chirp - left, key.chirp + right)
        return (
            Segment(start, key, segment.a[:, :, : left + 1], c[:, :, : left + 1]),
            Segment(key, end, c[:, :, left:], segment.b[:, :, -right - 1 :]),
        )

    def even(self, last: int, first: Traced | None, count: int) -> Retraced:
        """Return the frame from `count` keyframes at equal distances."""
        at, middle = np.rint(np.linspace(0, last, count)).astype(int), middle_chirp(last + 1)
        if count % 2:
            at[count // 2] = middle
        elif first is not None:
            self.times.append(middle * self.step)
        keyframes = [self.keyframe(int(c), first if count % 2 and c == middle else None) for c in np.unique(at)]
        return self.done([self.segment(a, b) for a, b in pairwise(keyframes)])

    def once(self, traced: Traced) -> Retraced:
        """Return the frame from the tracing of its middle alone."""
        key = self.keyframe(middle_chirp(self.chirps), traced)
        samples = self.carried.both(key, 0, self.chirps - 1).astype(complex)
        return self.made(samples, np.zeros_like(samples), (key,))

    def segment(self, start: Keyframe, end: Keyframe) -> Segment:
        """Return the segment between two keyframes."""
        far = reach(end.chirp - start.chirp)
        a = self.carried.both(start, start.chirp, start.chirp + far)
        return Segment(start, end, a, self.carried.both(end, end.chirp - far, end.chirp))

    def done(self, segments: list[Segment]) -> Retraced:
        """Return the frame of segments in order."""
        samples, error = joined([s.blend() for s in segments]), joined([s.error() for s in segments])
        return self.made(samples, error, (segments[0].start, *(s.end for s in segments)))

    def made(self, samples: Samples, error: Samples, keys: tuple[Keyframe, ...]) -> Retraced:
        """Return the frame of samples (2, antenna, chirp, sample) and their error, from keyframes."""
        if not self.radar.waveform.complex_sampling:
            samples, error = samples.real.astype(complex), error.real.astype(complex)
        return Retraced(
            samples=samples.sum(axis=0),
            turning=samples[0],
            turns=self.turns,
            error=error.sum(axis=0),
            times=tuple(sorted(self.times)),
            rays=self.rays,
            reached=self.reached,
            again=MadeAgain(keys, self.carried) if self.radar.impairments.phase_errors else None,
            tracings=tuple((key.paths, (key.chirp - key.since) * self.step) for key in keys),
        )

    def keyframe(self, chirp: int, known: Traced | None = None) -> Keyframe:
        """Return the keyframe at a chirp, traced unless the tracing is known."""
        now = self.scene.at(chirp * self.step)
        self.times.append(chirp * self.step)
        wave = self.radar.waveform
        geometry, since = (surface_at if known is None else geometry_of)(now, self.model.tolerance_db), 0
        if known is None:
            found: list[Batch] = []
            parts: list[Paths] = []
            rule = dataclasses.replace(self.rule, position=np.asarray(now.radar.position, float))
            stats = solve_into(parts.append, geometry, now.points(), now.radar, wave.carrier, rule, keep=found.append)
            self.rays += stats.rays
            known, since = Traced(join(parts), tuple(found)), chirp
        turned = [take(r, self.touches(r.body, r.kind)) for r in known.routes if isinstance(r, Routes)]
        some = joined_routes([r for r in turned if len(r.kind)], _ROUTES)
        routes = tuple(CarriedRoutes.of(r, geometry.facets, now.radar) for r in some)
        trajectories = known.paths.trajectories
        rest = ~self.touches(trajectories.body, trajectories.kind) | (trajectories.kind == DIFFRACT).any(axis=1)
        if self.progress:
            self.progress(len(self.times) / self.most)
        return Keyframe(
            chirp,
            now,
            routes,
            take(known.paths, rest[known.paths.trajectory]),
            known.paths,
            since,
        )

    def touches(self, body: NDArray[np.signedinteger], kind: NDArray[np.signedinteger]) -> NDArray[np.bool_]:
        """Return which sequences of interactions (n, d) meet a turning body."""
        return np.asarray((self.turns[np.maximum(body, 0)] & (kind > 0)).any(axis=1))


def _worth(segment: Segment, error: float, before: float, limit: float) -> bool:
    """Return whether a keyframe in the middle of a segment may help; not where the last split did not, for then the
    random part of the launches dominates."""
    return error > limit and error <= _HELPS * before and segment.chirps >= 5
