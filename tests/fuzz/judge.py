"""What a command may not do: end with a traceback or another code than 0 and 2, warn in numpy's words, write a NaN."""

from __future__ import annotations

import contextlib
import io
import json
import re
import warnings
from pathlib import Path

import h5py
import numpy as np


def problems_of(argv: list[str]) -> tuple[int | str, list[str]]:
    """Run a command; return its exit code, and what it did that it may not."""
    from raychan.cli import invoke

    out, err = io.StringIO(), io.StringIO()
    found: list[str] = []
    code: int | str = "none"
    with warnings.catch_warnings(record=True) as told, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        warnings.simplefilter("always")
        try:
            code = invoke(argv)
        except BaseException as error:
            import traceback

            last = traceback.extract_tb(error.__traceback__)[-1]
            found.append(f"{type(error).__name__}: {str(error)[:200]} at {last.filename}:{last.lineno}")
    said = out.getvalue() + err.getvalue()
    if code not in (0, 2) and not found:
        found.append(f"exit code {code}")
    if "Traceback" in said:
        found.append("a traceback was printed")
    if code == 2 and not err.getvalue().strip():
        found.append("exit code 2 without a word")
    if len(err.getvalue()) > 20_000:
        found.append(f"{len(err.getvalue())} characters on standard error")
    # -inf dBsm is what a body returns that is not lit at all.
    if code == 0 and re.search(r"(?<![\w.])(\+?inf|nan)(?![\w.])", out.getvalue().replace("-inf", "")):
        found.append("prints nan or inf")
    found += sorted({f"{w.category.__name__}: {w.message} at {w.filename}:{w.lineno}" for w in told})
    return code, found


def problems_in(out: Path) -> list[str]:
    """Return what a folder of results holds that it may not."""
    found = []
    for folder in [out, *out.glob("frame_*")]:
        if (folder / "result.nc").is_file():
            found += _file(folder / "result.nc")
            found += _summary(folder / "summary.json")
            text = (folder / "detections.csv").read_text(encoding="utf-8")
            if re.search(r"(?<![a-zA-Z])(nan|inf)(?![a-zA-Z])", text):
                found.append("detections.csv holds nan or inf")
        elif any(folder.glob("*.csv")) and folder is not out:
            found.append(f"half a folder: {sorted(p.name for p in folder.iterdir())}")
    stages = [p.name for p in out.parent.glob(".out*")]
    return found + ([f"left behind: {stages}"] if stages else [])


def _summary(path: Path) -> list[str]:
    strange: list[str] = []
    json.loads(path.read_text(encoding="utf-8"), parse_constant=strange.append)
    return [f"summary.json holds {', '.join(sorted(set(strange)))}"] if strange else []


def _file(path: Path) -> list[str]:
    found: list[str] = []

    def look(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fc":
            values = np.asarray(item[()])
            # What says that NaN stands for what is not there may hold it; a level in dB only where there is no power.
            unknown = np.isnan(values) & np.isnan(item.attrs.get("_FillValue", 0.0))
            if name.endswith("/power_dbm"):
                unknown &= item.parent["power"][()] == 0.0
            if not (np.isfinite(values) | unknown).all():
                found.append(f"result.nc: {name} is not finite")

    with h5py.File(path) as file:
        file.visititems(look)
    return found
