"""The study's runs, each simulated when first needed, and the detections of its targets in them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from raychan.columns import take
from raychan.processing.range_doppler import range_doppler
from raychan.records import TRANSMIT, Paths
from raychan.run.clock import STAGES
from raychan.run.receiver import noise_of_cell
from raychan.run.result import MULTIPATH, Result
from raychan.run.simulate import background, simulate
from raychan.signal.baseband import synthesize
from raychan.study.validation.data import POINT, Study, Target
from raychan.units import db
from raychan.world.errors import SceneError, nearest
from raychan.world.scene import Scene

Mask = NDArray[np.bool_]
_ROOM = 0.5  # m about a target's range in which its level without noise is read (not measured)
_NEAR = 1.0  # m: a detection within this of a ghost's expected range counts as that ghost (not measured)


class Bench:
    """Runs of a study, each simulated once.

    Args: study; tolerance_db [dB] in place of the scenes' own, or None; expected, number of runs; tell is called with
    the stage and the share done of these.
    """

    def __init__(
        self, study: Study, tolerance_db: float | None, expected: int, tell: Callable[[str, float], None]
    ) -> None:
        self.study, self.tolerance_db, self.expected, self.tell = study, tolerance_db, max(expected, 1), tell
        self.results: dict[str, Result] = {}
        self._scenes: dict[str, Scene] = {}
        self._files: dict[str, Scene] = {}

    def target(self, name: str) -> Target:
        """Return a target by its name; SceneError if there is none."""
        found: Target = _of(self.study.targets, name, "target")
        return found

    def scene(self, run: str) -> Scene:
        """Return the scene of a run, with its changes."""
        if run not in self._scenes:
            given = _of(self.study.runs, run, "run")
            self._scenes[run] = self.scene_file(given.scene).override(given.changes)
        return self._scenes[run]

    def scene_file(self, name: str) -> Scene:
        """Return the scene of a file by its name, without changes."""
        if name not in self._files:
            self._files[name] = Scene.load(self.study.scenes / f"{name}.toml")
        return self._files[name]

    def run(self, name: str) -> Result:
        """Return the result of a run, seed 0."""
        if name not in self.results:
            done = len(self.results)

            def tell(stage: str, share: float) -> None:
                at = STAGES.index(stage) if stage in STAGES else 0
                self.tell("simulate", (done + (at + share) / len(STAGES)) / self.expected)

            given = _of(self.study.runs, name, "run")
            made = simulate(
                self.scene(name),
                seed=0,
                tolerance_db=self.tolerance_db,
                max_bounces=given.max_bounces,
                progress=tell,
            )
            self.results[name] = made
        return self.results[name]

    def place(self, target: str) -> tuple[Any, float]:
        """Return the reference point (3,) [m] of a target in its scene, and its distance [m] from the radar."""
        given = self.target(target)
        scene = self.scene_file(given.scene)
        place = np.asarray(scene.radar.position)
        facets = scene.facets(0.0)
        if given.reference == POINT:
            points = scene.points(0.0)
            at = points.position[points.body == facets.body_names.index(given.parts[0])][0]
        else:
            chosen = np.zeros(len(facets.body), bool)
            for part in given.reference_parts or given.parts:
                chosen |= _is(part, facets.body, facets.part, facets)
            corners = facets.vertices[chosen]
            corners = corners[corners[:, :, 2].max(axis=1) > given.reference_above]
            if given.reference == "middle":
                area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
                at = np.average(corners.mean(axis=1), axis=0, weights=area)
            else:
                close = trimesh.triangles.closest_point(corners, np.broadcast_to(place, (len(corners), 3)))
                at = close[np.argmin(np.linalg.norm(close - place, axis=1))]
        return at, float(np.linalg.norm(at - place))

    def expected_range(self, target: str) -> float:
        """Return the range [m] at which an echo is expected: a ghost's stated one, or that of the target's place."""
        given = self.target(target)
        return self.place(target)[1] if given.near is None else given.near

    def found(self, run: str, target: str) -> int | None:
        """Return the detection whose leading chain holds a target, the nearest to its expected range, or None."""
        given, result = self.target(target), self.run(run)
        at = self.expected_range(target)
        rows = []
        for i, why in enumerate(result.provenance):
            chain = [link.strip("()") for link in (why.contributions[0].chain if why.contributions else ())]
            led = any(_named(link, part) for link in chain for part in given.parts)
            ghost = all(any(_named(link, part) for link in chain) for part in given.over)
            if led and ghost and bool(given.over) == (why.label == MULTIPATH):
                rows.append(i)
        if given.near is not None:
            rows = [i for i in rows if abs(result.detections.range[i] - at) <= _NEAR]
        return min(rows, key=lambda i: abs(result.detections.range[i] - at), default=None)

    def level(self, run: str, target: str) -> float | None:
        """Return the SNR [dB] without noise, at a target's range, of the paths over it alone; None without a path."""
        given, result = self.target(target), self.run(run)
        at = self.expected_range(target)
        # Paths of other lengths, folded ones too, reach this range by side lobes of the window only.
        ways = over(result, given.parts, given.over) & (np.abs(result.paths.range - at) <= _ROOM)
        if not ways.any():
            return None
        top = peak_snr(result, ways, at, _ROOM)
        return top if math.isfinite(top) else None  # all of its paths are blocked

    def strength(self, run: str, target: str) -> float | None:
        """Return the SNR [dB] of a target's detection or, where there is none, its level without noise."""
        row = self.found(run, target)
        return self.level(run, target) if row is None else float(self.run(run).detections.snr[row])


def over(result: Result, parts: tuple[str, ...], via: tuple[str, ...] = ()) -> Mask:
    """Return which paths (n,) meet one of `parts` and all of `via`; without `via`, those that meet no other target."""
    paths, trajectories = result.paths, result.paths.trajectories
    met = trajectories.kind > 0
    touched = [(_is(p, trajectories.body, trajectories.part, paths) & met).any(axis=1) for p in (*parts, *via)]
    led = np.any(touched[: len(parts)], axis=0)
    if via:
        return np.asarray((led & np.all(touched[len(parts) :], axis=0))[paths.trajectory])
    own = {p.split(".")[0] for p in parts} | set(background(result.require_scene().facets(0.0)))
    strange = [i for i, name in enumerate(paths.body_names) if name not in own]
    led &= ~(np.isin(trajectories.body, strange) & met & (trajectories.kind != TRANSMIT)).any(axis=1)
    return np.asarray(led[paths.trajectory])


def peak_snr(result: Result, ways: Mask, at: float, room: float) -> float:
    """Return the highest SNR [dB] within `room` [m] of a range [m] in a map of some paths (n,) without noise."""
    scene = result.require_scene()
    settings, quiet = scene.processing, dataclasses.replace(scene.radar, noise=False)
    cube = synthesize(take(result.paths, ways), quiet)
    made = range_doppler(cube, quiet.waveform, settings.range_window, settings.rate_window, settings.pad)
    column = np.abs(made.range - at) <= room
    return float(db(made.power[:, column].max() / noise_of_cell(scene.radar, settings)))


def _is(part: str, body: Any, kind: Any, names: Paths | Any) -> Mask:
    """Return where arrays of body and part numbers name 'body' or 'body.part'."""
    first, _, second = part.partition(".")
    if first not in names.body_names or (second and second not in names.part_names):
        raise SceneError(f"no part '{part}'", key="parts", value=part, allowed=nearest(first, names.body_names))
    here = body == names.body_names.index(first)
    return np.asarray(here & (kind == names.part_names.index(second)) if second else here)


def _named(link: str, part: str) -> bool:
    return link == part or link.startswith(f"{part}.")


def _of(table: Any, name: str, what: str) -> Any:
    if name not in table:
        raise SceneError(f"no {what} '{name}'", key=what, value=name, allowed=nearest(name, table))
    return table[name]
