"""Large arrays whose copies differ in a few rows: copies share the memory pages that nobody writes to."""

from __future__ import annotations

import mmap
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray


class SharedRows:
    """An array (n, ...) kept to be copied. On Linux (memfd_create) copies share all pages that nobody writes to;
    elsewhere they are plain copies."""

    def __init__(self, array: NDArray[Any]) -> None:
        self._file = -1
        self._shape, self._dtype, self._size = array.shape, array.dtype, array.nbytes
        self._plain: NDArray[Any] | None = array
        if self._size and hasattr(os, "memfd_create"):
            self._file = os.memfd_create("raychan")
            os.ftruncate(self._file, self._size)
            whole = np.frombuffer(mmap.mmap(self._file, self._size), self._dtype)
            whole.reshape(self._shape)[:] = array
            self._plain = None

    def copy(self) -> NDArray[Any]:
        """Return a copy that may be written to."""
        if self._plain is not None:
            return self._plain.copy()
        pages = mmap.mmap(self._file, self._size, access=mmap.ACCESS_COPY)
        return np.frombuffer(pages, self._dtype).reshape(self._shape)

    def __del__(self) -> None:
        if self._file >= 0:
            os.close(self._file)
