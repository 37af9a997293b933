"""A logged pose file in place of a model: read, checked, and followed between its rows."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from raychan.dynamics.ship import PHI, PSI, Array, P, R, U, X, Y
from raychan.world.errors import SceneError, is_guess, nearest, shown

COLUMNS = ("t_s", "x_m", "y_m", "heading_deg", "roll_deg")
"""Columns that a pose file must have."""
OPTIONAL = ("pitch_deg", "z_m")
"""Columns that it may have; others are ignored."""
_LATEST, _LARGEST = 1e11, 1e9  # s, which Unix times may be; m and deg


@dataclass(frozen=True)
class PoseFile:
    """Logged poses: `time` (n,) [s] from 0 on, `pose` (n, 6) x, y, z [m], yaw, pitch, roll [rad] in the world; `start`
    [s] the log's own time of its first row; `optional` which of `OPTIONAL` the log has."""

    time: Array
    pose: Array
    start: float = 0.0
    optional: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """From the first row to the last [s]."""
        return float(self.time[-1])

    def at(self, times: Array) -> Array:
        """Return the poses (m, 6) at times (m,) [s], evenly between rows."""
        return np.stack([np.interp(times, self.time, column) for column in self.pose.T], axis=1)

    def state(self, time: float) -> Array:
        """Return the full state (10,) of `dynamics.ship.STATE` at a time [s]; rates are those between two rows, the
        rudder and the shaft are unknown and 0."""
        row = int(np.clip(np.searchsorted(self.time, time, side="right"), 1, len(self.time) - 1))
        rates = (self.pose[row] - self.pose[row - 1]) / (self.time[row] - self.time[row - 1])
        now = self.at(np.array([time]))[0]
        state = np.zeros(10)
        state[X], state[Y], state[PSI], state[PHI] = now[0], -now[1], -now[3], now[5]
        state[U], state[R], state[P] = np.hypot(rates[0], rates[1]), -rates[3], rates[5]
        return state


def read_poses(file: Path, max_gap: float) -> PoseFile:
    """Return the poses of a CSV file with `COLUMNS`; rows no further apart than `max_gap` [s].

    Raises: SceneError with the line and the value: a missing column, no number, time running backwards, a gap; with
    the key file or max_gap_s where that is at fault.
    """
    rows, columns, width = _rows(file)
    lines, values = [], []
    for line, row in rows:
        lines.append(line)
        if len(row) > width:
            problem = f"{len(row)} fields in a file of {width} columns"
            raise SceneError(problem, file=file, line=line, value=row, allowed="one field in each column")
        values.append([_number(file, line, name, row[at]) if at < len(row) else _short(file, line, name)
                       for name, at in columns.items()])  # fmt: skip
    if len(values) < 2:
        raise SceneError("too few rows", file=file, value=len(values), allowed="2 or more poses")
    table = dict(zip(columns, np.array(values).T, strict=True))
    time = table["t_s"]
    for k in range(1, len(time)):
        step = time[k] - time[k - 1]
        if step <= 0.0:
            problem = f"t_s = {time[k]:.15g} after {time[k - 1]:.15g}: time does not grow"
            raise SceneError(problem, file=file, line=lines[k], value=time[k], allowed="times that grow")
        if step > max_gap:
            problem = f"t_s = {time[k]:.15g} after {time[k - 1]:.15g}: a gap of {step:g} s"
            allowed = f"at most {max_gap:g} s; a longer one with replay.max_gap_s"
            raise SceneError(problem, file=file, line=lines[k], key="max_gap_s", value=step, allowed=allowed)
    none = np.zeros(len(time))
    heading, pitch, roll = (np.radians(table.get(k, none)) for k in ("heading_deg", "pitch_deg", "roll_deg"))
    place = table["x_m"], table["y_m"], table.get("z_m", none)
    pose = np.stack([*place, -np.unwrap(heading), pitch, roll], axis=1)
    optional = tuple(name for name in OPTIONAL if name in table)
    return PoseFile(time=time - time[0], pose=pose, start=float(time[0]), optional=optional)


def _rows(file: Path) -> tuple[list[tuple[int, list[str]]], dict[str, int], int]:
    """Return the rows of a pose file with their lines, where each column of a pose stands, and how many columns the
    file has."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        allowed = "a pose file (CSV) that exists"
        raise SceneError("file not found", file=file, key="file", allowed=allowed) from None
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise SceneError(f"cannot be read ({why})", file=file, key="file", allowed="a pose file (CSV)") from error
    reader = csv.reader(text.splitlines())
    try:
        rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise SceneError(f"no CSV: {error}", file=file, line=reader.line_num, allowed="a pose file (CSV)") from error
    if not rows:
        raise SceneError("is empty", file=file, allowed=f"columns {', '.join(COLUMNS)}")
    heads = [cell.strip() for cell in rows[0][1]]
    for name in COLUMNS:
        if name not in heads:
            found = nearest(name, heads)
            allowed = f"columns {', '.join(COLUMNS)}" + (f"; {found}" if is_guess(found) else "")
            raise SceneError(f"column {name} is missing", file=file, line=rows[0][0], value=heads, allowed=allowed)
    if len(set(heads)) < len(heads):
        raise SceneError("two columns have one name", file=file, line=rows[0][0], value=heads, allowed="each name once")
    return rows[1:], {name: heads.index(name) for name in (*COLUMNS, *OPTIONAL) if name in heads}, len(heads)


def _number(file: Path, line: int, column: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    most = _LATEST if column == "t_s" else _LARGEST
    if not abs(value) <= most:
        allowed = f"a finite number from {-most:g} to {most:g}"
        raise SceneError(f"{column} = {shown(text)}", file=file, line=line, value=text, allowed=allowed)
    return value


def _short(file: Path, line: int, column: str) -> float:
    raise SceneError(f"{column} is missing", file=file, line=line, allowed="a number in each column")
