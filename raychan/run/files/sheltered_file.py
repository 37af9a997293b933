"""A file for HDF5 that grows on disk and may meet a full one: HDF5 crashes when it cannot close what it could not
write, so that it is never told; whoever writes asks `check`."""

from __future__ import annotations

import os
from pathlib import Path


class ShelteredFile:
    """A file that takes every write. What the disk refuses is kept in memory and read back from there: of a writer that
    calls `check` after each block, that is one block. Use as the file of `h5py.File`."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w+b", buffering=0)
        self._at = self._end = 0
        self._kept: list[tuple[int, bytes]] = []
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the OSError of the first write that the disk refused, if it refused one."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Close the file on disk. Raises: OSError, of an earlier write too."""
        try:
            self._file.close()
        finally:
            self.check()

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place and return it."""
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._end}[whence]
        return self._at

    def tell(self) -> int:
        """Return the place."""
        return self._at

    def write(self, data: bytes | memoryview) -> int:
        """Write all the bytes and return their number."""
        rest = memoryview(data).cast("B")
        size, at = len(rest), self._at
        try:
            self._file.seek(at)
            while rest and self._error is None:
                written = self._file.write(rest) or 0
                at, rest = at + written, rest[written:]
        except OSError as error:
            self._error = error
        if rest:
            self._kept.append((at, bytes(rest)))
        self._at += size
        self._end = max(self._end, self._at)
        return size

    def readinto(self, buffer: memoryview) -> int:
        """Fill a buffer, with zeros where nothing was written, and return its size."""
        view = memoryview(buffer).cast("B")
        start, size = self._at, len(view)
        view[:] = bytes(size)
        self._file.seek(start)
        filled = 0
        while filled < size and (got := self._file.readinto(view[filled:])):
            filled += got
        for at, data in self._kept:
            low, high = max(at, start), min(at + len(data), start + size)
            if low < high:
                view[low - start : high - start] = data[low - at : high - at]
        self._at += size
        return size

    def read(self, size: int) -> bytes:
        """Return bytes, zeros where nothing was written."""
        found = bytearray(size)
        self.readinto(memoryview(found))
        return bytes(found)

    def truncate(self, size: int) -> int:
        """Cut or lengthen the file."""
        try:
            self._file.truncate(size)
        except OSError as error:
            self._error = self._error or error
        self._end = size
        return size

    def flush(self) -> None:
        """Do nothing: each write goes to the disk at once."""
