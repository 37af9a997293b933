"""What a command writes into a folder of its own, and what of others may stand in its way there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

from raychan.run.files.atomic_swap import is_dead, is_mark

_BEGINNING = 64  # bytes of a file that are looked at
_BEGINS: dict[str, bytes | tuple[bytes, ...]] = {".nc": (b"\x89HDF", b"CDF"), ".json": b"{"}
_ELSEWHERE = "move it away or name another folder"


@dataclass(frozen=True)
class Contents:
    """Patterns of the names that a command writes into a folder of its own.

    names: all that it may write; those of an earlier run are replaced. signs: every such folder has at least one of
    these; in a folder without any, files of these names are foreign and stay untouched. A pattern 'a_*/' is a folder
    with the same contents. begins: how a sign begins, blanks left out, whose name other commands use too."""

    names: tuple[str, ...]
    signs: tuple[str, ...]
    begins: Mapping[str, bytes] = field(default_factory=dict)

    def owns(self, entry: Path) -> bool:
        """Return whether a file, or a folder and all in it, has a name that the command writes."""
        if is_mark(entry):
            return is_dead(entry)
        if _is_folder(entry):
            return self.nests(entry) and all(map(self.owns, entry.iterdir()))
        return any(fnmatch(entry.name, name) for name in self.names)

    def nests(self, entry: Path) -> bool:
        """Return whether an inner folder is one with the same contents."""
        return any(name.endswith("/") and fnmatch(entry.name, name[:-1]) for name in self.names)

    def signed(self, folder: Path) -> bool:
        """Return whether the command wrote this folder."""
        return any(self._is_sign(file) for sign in self.signs for file in folder.glob(sign))

    def obstacle_of_each(self, folder: Path) -> str:
        """Return which file of the command's names is another's, '' where none is, for a command that keeps no folder
        of its own: each file must begin as the command's does. An empty file holds nothing of anyone."""
        for entry in (folder / name for name in self.names):
            if entry.is_dir():
                return f"{entry}: is a directory in the place of a file; {_ELSEWHERE}"
            if entry.is_file() and entry.stat().st_size and not self._is_sign(entry):
                return f"{entry}: exists, and is not a file of this command; {_ELSEWHERE}"
        return ""

    def _is_sign(self, file: Path) -> bool:
        """Return whether a file named as a result is of the kind that its name says: a note of one's own is none, nor
        is another command's result of the same name."""
        try:
            with file.open("rb") as opened:
                begins = opened.read(_BEGINNING).lstrip()
        except OSError:
            return False
        own = b"".join(begins.split()).startswith(self.begins.get(file.name, b""))
        return own and begins.startswith(_BEGINS.get(file.suffix, b""))

    def obstacle(self, folder: Path, signed: bool = False) -> str:
        """Return what of others is in the way in a folder and its inner ones, '' where nothing is.

        Args: signed, whether the command wrote a folder around this one."""
        signed = signed or self.signed(folder)
        for entry in (e for e in folder.iterdir() if not is_mark(e)):
            if self.nests(entry):
                if not _is_folder(entry):
                    return f"{entry}: is a file in the place of a directory; {_ELSEWHERE}"
                if within := self.obstacle(entry, signed):
                    return within
            elif any(fnmatch(entry.name, name) for name in self.names):
                if _is_folder(entry):
                    return f"{entry}: is a directory in the place of a file; {_ELSEWHERE}"
                if not signed:
                    return f"{entry}: exists, and {folder} is not a folder of results; {_ELSEWHERE}"
        return ""


def _is_folder(entry: Path) -> bool:
    """Return whether an entry is a folder itself, not a link to one."""
    return entry.is_dir() and not entry.is_symlink()
