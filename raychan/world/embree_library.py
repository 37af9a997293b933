"""Embree's library, which embreex ships: the one door to it. Scenes are built here; compiled code casts the rays.

embreex itself casts each ray through the interpreter's objects; here kernels get the address of a function of the
library, and of a scene.
"""

from __future__ import annotations

import ctypes
import weakref
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import threads

MAJOR = 4  # of the version: records and functions are those of embree4/rtcore.h
_TRIANGLE, _INDEX, _VERTEX, _FLOAT3, _UINT3, _ROBUST, _VERSION = 0, 0, 1, 0x9003, 0x5003, 4, 0
_OUT_OF_MEMORY = 4
_ADDRESS, _NUMBER = ctypes.c_void_p, ctypes.c_uint
_FUNCTIONS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "rtcNewDevice": (_ADDRESS, (ctypes.c_char_p,)),
    "rtcGetDeviceProperty": (ctypes.c_ssize_t, (_ADDRESS, ctypes.c_int)),
    "rtcGetDeviceError": (ctypes.c_int, (_ADDRESS,)),
    "rtcNewScene": (_ADDRESS, (_ADDRESS,)),
    "rtcSetSceneFlags": (None, (_ADDRESS, ctypes.c_int)),
    "rtcReleaseScene": (None, (_ADDRESS,)),
    "rtcNewGeometry": (_ADDRESS, (_ADDRESS, ctypes.c_int)),
    "rtcSetNewGeometryBuffer": (
        _ADDRESS,
        (_ADDRESS, ctypes.c_int, _NUMBER, ctypes.c_int, ctypes.c_size_t, ctypes.c_size_t),
    ),
    "rtcCommitGeometry": (None, (_ADDRESS,)),
    "rtcAttachGeometry": (_NUMBER, (_ADDRESS, _ADDRESS)),
    "rtcReleaseGeometry": (None, (_ADDRESS,)),
    "rtcCommitScene": (None, (_ADDRESS,)),
    "rtcIntersect4": (None, (_ADDRESS, _ADDRESS, _ADDRESS, _ADDRESS)),
}


class NoEmbree(ImportError):
    """Embree's library is not there, or is not the version that compiled code can call."""


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """Return Embree's library. Raises: NoEmbree, which names the library and its version."""
    try:
        package = distribution("embreex")
    except PackageNotFoundError:
        raise NoEmbree(f"the package embreex, which ships Embree {MAJOR}, is not installed") from None
    named = f"embreex {package.version}"
    found = [f for f in package.files or () if _is_embree(f.name)]
    if not found:
        raise NoEmbree(f"{named} ships no library of Embree {MAJOR} (libembree{MAJOR}, embree{MAJOR}.dll)")
    import embreex.rtcore_scene  # noqa: F401  (it finds the libraries that Embree needs itself)

    path = Path(str(package.locate_file(found[0])))
    try:
        loaded = ctypes.CDLL(str(path))
        for name, (result, arguments) in _FUNCTIONS.items():
            function = getattr(loaded, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as reason:
        raise NoEmbree(f"{path} of {named} is not Embree {MAJOR} or cannot be loaded: {reason}") from None
    return loaded


def _is_embree(name: str) -> bool:
    """Tell whether a file of this name is the library, on Linux, macOS or Windows."""
    return name.startswith((f"libembree{MAJOR}", f"embree{MAJOR}")) and any(
        ending in name for ending in (".so", ".dylib", ".dll")
    )


@lru_cache(maxsize=1)
def _device() -> int:
    """Return the address of the device that makes all scenes. Raises: NoEmbree for another version."""
    embree = library()
    # Another process's threads, and those of one that forked, are its own: Embree starts them as it needs them.
    device: int | None = embree.rtcNewDevice(f"threads={threads()}".encode())
    if not device:
        raise NoEmbree(f"{embree._name} makes no device: error {embree.rtcGetDeviceError(None)}")
    version = int(embree.rtcGetDeviceProperty(device, _VERSION))
    if version // 10_000 != MAJOR:
        parts = ".".join(map(str, (version // 10_000, version // 100 % 100, version % 100)))
        raise NoEmbree(f"{embree._name} is Embree {parts}; compiled code calls Embree {MAJOR}")
    return device


def intersect_address() -> np.uintp:
    """Return the address of rtcIntersect4."""
    return np.uintp(ctypes.cast(library().rtcIntersect4, _ADDRESS).value or 0)


class EmbreeScene:
    """A scene of triangles, which Embree frees with this object.

    Args: corners (n, 3, 3) float32 [m]. Fields: address, for compiled code.
    """

    def __init__(self, corners: NDArray[np.float32]) -> None:
        embree, device = library(), _device()
        scene, shape = embree.rtcNewScene(device), embree.rtcNewGeometry(device, _TRIANGLE)
        weakref.finalize(self, embree.rtcReleaseScene, scene).atexit = False  # the process ends faster
        self.address = np.uintp(scene)
        embree.rtcSetSceneFlags(scene, _ROBUST)
        n = len(corners)
        parts: tuple[tuple[int, int, Any, NDArray[Any]], ...] = (
            (_VERTEX, _FLOAT3, ctypes.c_float, corners.reshape(-1, 3)),
            (_INDEX, _UINT3, ctypes.c_uint32, np.arange(3 * n, dtype=np.uint32).reshape(-1, 3)),
        )
        for slot, form, kind, data in parts:
            room = embree.rtcSetNewGeometryBuffer(shape, slot, 0, form, 3 * ctypes.sizeof(kind), len(data))
            if not room:
                break  # told below
            np.ctypeslib.as_array(ctypes.cast(room, ctypes.POINTER(kind)), data.shape)[:] = data
        else:
            embree.rtcCommitGeometry(shape)
            embree.rtcAttachGeometry(scene, shape)
            embree.rtcCommitScene(scene)
        embree.rtcReleaseGeometry(shape)
        error = embree.rtcGetDeviceError(device)
        if error == _OUT_OF_MEMORY:
            raise MemoryError(f"Embree has no memory for {n} triangles")
        if error:
            raise RuntimeError(f"Embree does not take {n} triangles: error {error}")
