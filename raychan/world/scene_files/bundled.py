"""The scenes and antennas that ship with raychan, by name: in a wheel beside the code, in a checkout above it."""

from __future__ import annotations

from pathlib import Path

_CODE = Path(__file__).resolve().parents[2]


def folder() -> Path | None:
    """Return the folder of the bundled scenes; None where they are not installed."""
    if (_CODE / "scenes").is_dir():
        return _CODE / "scenes"
    above = _CODE.parent
    return above / "scenes" if (above / "pyproject.toml").is_file() and (above / "scenes").is_dir() else None


def names() -> list[str]:
    """Return the names of the bundled scenes of a radar."""
    return sorted(set(_all()) - set(ship_names()))


def ship_names() -> list[str]:
    """Return the names of the bundled scenes of a ship, which have tables of their own (`raychan ship`)."""
    return [name for name in _all() if name.startswith("ship_")]


def antenna_names() -> list[str]:
    """Return the names of the bundled antennas, such as 'antennas/patch'."""
    there = folder()
    return sorted(f"antennas/{file.stem}" for file in (there / "antennas").glob("*.toml")) if there else []


def _all() -> list[str]:
    there = folder()
    return sorted(file.stem for file in there.glob("*.toml")) if there else []


def found(path: str | Path, within: Path | None = None) -> Path:
    """Return a file as given, or, where there is none, the bundled one of that name.

    Args: path of a file, or a name such as 'urban' or 'antennas/patch'; within, the folder that `path` refers to.
    """
    file = Path(path) if within is None else within / path
    there = folder()
    if file.is_file() or there is None or Path(path).is_absolute():
        return file
    own = there / path
    for choice in (own, own.with_name(f"{own.name}.toml")):
        if choice.is_file() and choice.resolve().is_relative_to(there.resolve()):
            return choice
    return file
