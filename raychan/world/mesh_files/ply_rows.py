"""The rows of a PLY's elements, of text or binary, whose lists may differ in length from row to row."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.world.errors import SceneError, shown
from raychan.world.meshes.mesh import Ints

_COUNT = re.compile(rb"\+?[0-9]{1,18}")  # as many digits as an integer of 64 bits holds


@dataclass(frozen=True)
class Property:
    """A number of each row, or where `count` is a type the list of which that counts the entries; types as NumPy's."""

    name: str
    kind: str
    count: str = ""


@dataclass(frozen=True)
class Element:
    """Rows of the same properties; byte order '<' or '>', '' in text."""

    name: str
    rows: int
    properties: list[Property]
    order: str = ""

    @property
    def types(self) -> list[tuple[np.dtype[Any] | None, np.dtype[Any]]]:
        """Of each property the type of its count, None where it is no list, and of its numbers."""
        return [
            (np.dtype(self.order + p.count) if p.count else None, np.dtype(self.order + p.kind))
            for p in self.properties
        ]


@dataclass(frozen=True)
class Column:
    """One property of all rows: values one after the other, how many each row has, and in text the rows' lines."""

    values: NDArray[Any]
    lengths: Ints
    lines: Sequence[int] = ()


Tables = dict[str, dict[str, Column]]
Wanted = Mapping[str, Iterable[str]]


def binary_rows(data: bytes, elements: list[Element], wanted: Wanted, lines: int, file: Path) -> Tables:
    """Return the wanted properties of elements in bytes.

    Raises: SceneError where there are too few or too many bytes, or a list has less than no entries.
    """
    del lines
    at, found = 0, Tables()
    for element in elements:
        found[element.name], at = _binary(data, at, element, wanted.get(element.name, ()), file)
    if at != len(data):
        counts = ", ".join(f"{e.name} {e.rows}" for e in elements)
        problem = f"does not end with its elements: {len(data)} bytes after the header, {at} expected ({counts})"
        raise SceneError(problem, file=file, value=len(data), allowed="a whole PLY")
    return found


def _binary(data: bytes, at: int, element: Element, wanted: Iterable[str], file: Path) -> tuple[dict[str, Column], int]:
    """Return the wanted properties of one element that begins at a byte, and where it ends."""
    rows, types = element.rows, element.types
    if not rows:
        return {}, at
    least = sum((kind if count is None else count).itemsize for count, kind in types)
    starts, lengths, end = _walk(data, at, element, 1) if at + least * rows <= len(data) else _none(types)
    if not len(starts):
        raise _cut(data, element, file)
    size = max(end - at, 0)
    alike = at + size * rows <= len(data) and all(
        count is None or _repeats(data, starts[0, j] - count.itemsize, count.itemsize, size, rows)
        for j, (count, _) in enumerate(types)
    )
    if not alike:
        starts, lengths, end = _walk(data, at, element, rows)
        if end > len(data):
            raise _cut(data, element, file)
    else:
        end = at + size * rows
    found = {}
    for j, (part, (_, kind)) in enumerate(zip(element.properties, types, strict=True)):
        if part.name not in wanted:
            continue
        if alike:
            n = int(lengths[0, j])
            grid: NDArray[Any] = np.ndarray((rows, n), kind, data, int(starts[0, j]), (size, kind.itemsize))
            found[part.name] = Column(grid.ravel(), np.full(rows, n))
        else:
            found[part.name] = Column(_gathered(data, starts[:, j], lengths[:, j], kind), lengths[:, j])
    return found, end


def _none(types: list[Any]) -> tuple[Ints, Ints, int]:
    return np.zeros((0, len(types)), np.int64), np.zeros((0, len(types)), np.int64), 0


def _cut(data: bytes, element: Element, file: Path) -> SceneError:
    problem = f"is cut short or damaged: {len(data)} bytes after the header end within its {element.rows} "
    problem += f"of '{element.name}'"
    return SceneError(problem, file=file, value=len(data), allowed="a whole PLY")


def _repeats(data: bytes, at: int, width: int, step: int, rows: int) -> bool:
    """Return whether some bytes are alike in all rows of as many bytes."""
    column: NDArray[Any] = np.ndarray((rows, width), np.uint8, data, int(at), (step, 1))
    return bool((column == column[0]).all())


def _walk(data: bytes, at: int, element: Element, rows: int) -> tuple[Ints, Ints, int]:
    """Return where the numbers of each property begin (rows, p), how many there are, and where the last row ends,
    beyond the data where these are cut short."""
    steps = [(count.itemsize if count else 0, count is not None and count.kind == "i", kind.itemsize)
             for count, kind in element.types]  # fmt: skip
    order: Any = "big" if element.order == ">" else "little"
    starts, lengths, most = list[int](), list[int](), len(data)
    for _ in range(rows):
        for width, signed, item in steps:
            n = 1
            if width:
                n = int.from_bytes(data[at : at + width], order, signed=signed)
                at += width
            starts.append(at)
            lengths.append(n)
            at += n * item
            if n < 0 or at > most:
                return *_none(element.types)[:2], most + 1
    return np.array(starts).reshape(rows, -1), np.array(lengths).reshape(rows, -1), at


def _gathered(data: bytes, starts: Ints, lengths: Ints, kind: np.dtype[Any]) -> NDArray[Any]:
    """Return the numbers of lists, one after the other."""
    inside = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    byte = np.repeat(starts, lengths) + kind.itemsize * inside
    return np.frombuffer(data, np.uint8)[byte[:, None] + np.arange(kind.itemsize)].view(kind).ravel()


def text_rows(data: bytes, elements: list[Element], wanted: Wanted, lines: int, file: Path) -> Tables:
    """Return the wanted properties of elements in text, a row a line, after so many lines of a header.

    Raises: SceneError for too few or too many lines, and for a line that has other than its numbers.
    """
    rows = [(lines + i, line) for i, line in enumerate(data.splitlines(), 1) if line.strip()]
    expected = sum(e.rows for e in elements)
    if len(rows) != expected:
        counts = ", ".join(f"{e.name} {e.rows}" for e in elements)
        wrong = "is cut short" if len(rows) < expected else "does not end with its elements"
        problem = f"{wrong}: {len(rows)} lines after the header, {expected} expected ({counts})"
        raise SceneError(problem, file=file, value=len(rows), allowed="a whole PLY")
    found, at = Tables(), 0
    for element in elements:
        mine = rows[at : at + element.rows]
        at += element.rows
        found[element.name] = _text(mine, element, wanted.get(element.name, ()), at == expected, file) if mine else {}
    return found


def _text(
    rows: list[tuple[int, bytes]], element: Element, wanted: Iterable[str], last: bool, file: Path
) -> dict[str, Column]:
    """Return the wanted properties of an element; last: of the file."""
    texts: dict[str, list[bytes]] = {name: [] for name in wanted}
    lengths: dict[str, list[int]] = {name: [] for name in wanted}
    for row, (number, line) in enumerate(rows):
        words, at = line.split(), 0
        for part in element.properties:
            n = 1
            if part.count:
                n = _count(words[at : at + 1], number, line, file)
                at += 1
            if part.name in texts:
                texts[part.name] += words[at : at + n]
                lengths[part.name].append(n)
            at += n
        if at != len(words):
            off, text = abs(at - len(words)), line.decode("latin-1").strip()
            if at > len(words) and last and row == len(rows) - 1:
                problem = f"is cut short: its last line lacks {off} of its numbers"
                raise SceneError(problem, file=file, value=text, allowed="a whole PLY")
            what = f"lacks {off} of its numbers" if at > len(words) else f"has {off} numbers too many"
            problem = f"{shown(text)}, row {row + 1} of '{element.name}', {what}"
            raise SceneError(problem, file=file, value=text, allowed=f"{at} numbers", line=number)
    numbers, found = [number for number, _ in rows], {}
    for part in element.properties:
        if part.name in texts:
            values = _floats(texts[part.name], lengths[part.name], numbers, file)
            # As declared where that is a float; whole numbers are left, for rounding would hide that they are none.
            kind = part.kind if part.kind.startswith("f") else "f8"
            found[part.name] = Column(values.astype(kind), np.array(lengths[part.name], np.int64), numbers)
    return found


def _count(word: list[bytes], number: int, line: bytes, file: Path) -> int:
    """Return how many entries a list says to have; none where the line has ended."""
    if not word:
        return 0
    if _COUNT.fullmatch(word[0]):
        return int(word[0])
    text = line.decode("latin-1").strip()
    problem = f"{shown(text)} has a list of {shown(word[0].decode('latin-1'))} entries"
    raise SceneError(problem, file=file, value=text, allowed="a number from 0 on, of 18 digits at most", line=number)


def _floats(words: list[bytes], lengths: list[int], lines: list[int], file: Path) -> NDArray[np.float64]:
    """Return words as numbers; raise SceneError for the first that is none."""
    try:
        if b"_" not in b" ".join(words):  # which Python takes as a mark between digits
            return np.array(list(map(float, words)), float)
    except ValueError:
        pass
    wrong = next(i for i, word in enumerate(words) if not _is_number(word))
    number = lines[int(np.searchsorted(np.cumsum(lengths), wrong, "right"))]
    text = words[wrong].decode("latin-1")
    raise SceneError(f"{shown(text)} is no number", file=file, value=text, allowed="numbers", line=number)


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return b"_" not in word
