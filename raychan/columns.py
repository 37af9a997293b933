"""What a record is: a frozen struct of arrays whose columns declare axes, dtype and unit.

Letters of axes that are shared within a record must agree. The constructor checks all that, rejects NaN and infinity,
and makes the arrays read-only.
"""

from __future__ import annotations

import dataclasses
from copy import copy
from dataclasses import field
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.reprs import Described


def column(axes: str, dtype: Any = np.float64, unit: str = "1", doc: str = "", finite: bool = True) -> Any:
    """Declare an array field: axes as space-separated letters or numbers ('n 3'), dtype, unit, meaning."""
    meta = {"axes": axes.split(), "dtype": np.dtype(dtype), "unit": unit, "doc": doc, "finite": finite}
    return field(metadata=meta)


class Record(Described):
    """Base of all records: checks and freezes every declared column when built.

    Records are equal if they are of one class with equal fields, arrays of equal type, shape and numbers (NaN is NaN).
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.__eq__ = Record.__eq__  # type: ignore[method-assign]  # else dataclass asks arrays whether they are true

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        names = (f.name for f in dataclasses.fields(self))  # type: ignore[arg-type]
        return all(_equal(getattr(self, name), getattr(other, name)) for name in names)

    __hash__ = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for f in dataclasses.fields(self):  # type: ignore[arg-type]
            if "axes" in f.metadata:
                object.__setattr__(self, f.name, self._checked(f, sizes))

    def _checked(self, f: dataclasses.Field[Any], sizes: dict[str, int]) -> NDArray[Any]:
        where = f"{type(self).__name__}.{f.name}"
        axes, dtype = f.metadata["axes"], f.metadata["dtype"]
        given = np.asarray(getattr(self, f.name))
        if not np.can_cast(given.dtype, dtype, "same_kind") and given.size:
            raise TypeError(f"{where}: dtype {given.dtype} given, {dtype} wanted")
        value = given.astype(dtype, copy=False).view()
        if value.ndim != len(axes):
            raise ValueError(f"{where}: shape {value.shape} given, axes ({', '.join(axes)}) wanted")
        for axis, size in zip(axes, value.shape, strict=True):
            want = int(axis) if axis.isdigit() else sizes.setdefault(axis, size)
            if size != want:
                raise ValueError(f"{where}: axis {axis} is {size} long, {want} wanted")
        if f.metadata["finite"] and dtype.kind in "fc" and not np.isfinite(value).all():
            raise ValueError(f"{where}: holds NaN or infinity")
        value.flags.writeable = False
        return value

    def rebuilt(self, **columns: Any) -> Self:
        """Return a copy with other columns or fields of the same form, frozen but not checked: the caller answers for
        them.

        Checking a record of 1e6 rows, of which few change, takes longer than the change.
        """
        out = copy(self)
        for name, value in columns.items():
            if isinstance(value, np.ndarray):
                value = value.view()
                value.flags.writeable = False
            object.__setattr__(out, name, value)
        return out

    def replace(self, **changes: object) -> Self:
        """Return a copy with some fields changed (and all checked again)."""
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


def _equal(one: Any, other: Any) -> bool:
    if not isinstance(one, np.ndarray):
        return bool(one == other)
    if one is other:
        return True
    alike = isinstance(other, np.ndarray) and (one.dtype, one.shape) == (other.dtype, other.shape)
    return alike and bool(np.array_equal(one, other, equal_nan=one.dtype.kind in "fc"))


def row_numbers(index: NDArray[np.generic]) -> NDArray[np.intp]:
    """Return the numbers of the rows at `index` (mask or numbers); numpy takes rows by number up to ten times
    faster."""
    return np.flatnonzero(index) if index.dtype == np.bool_ else np.asarray(index, np.intp)


R = TypeVar("R", bound=Record)


def take(record: R, index: Any) -> R:
    """Return the rows `index` of a record whose row axis is 'n'."""
    changes = {
        f.name: getattr(record, f.name)[index]
        for f in dataclasses.fields(record)  # type: ignore[arg-type]
        if f.metadata.get("axes", [""])[0] == "n"
    }
    return record.replace(**changes)
