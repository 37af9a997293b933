"""The packet in which compiled code asks Embree for the first hits of a ray and its two companions.

Four rays that Embree follows together (RTCRayHit4 of embree4/rtcore_ray.h: one word of each ray after another), which
of them are valid, and the arguments (RTCIntersectArguments) lie in one block of memory. A kernel gets the block as two
arrays, its words as float32 and as int32.

A packet takes 0.95 times the time of three single rays (8.8 million of the urban scene at 0.5 dB: 1.79 s, 1.87 s), and
each of its rays meets the facet that it meets alone.
"""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

from raychan.compile.foreign_calls import call
from raychan.compile.jit import njit

LANES = 4
COMPANIONS = 2
# Words from the start: of the rays, of what is hit; then, outside of Embree's record, which rays are valid, arguments.
ORIGIN, NEAR, DIRECTION, TIME, FAR, MASK, RAY_ID, RAY_FLAGS = 0, 12, 16, 28, 32, 36, 40, 44
NORMAL, PRIMITIVE, GEOMETRY, INSTANCE = 48, 68, 72, 76
RECORD_END, VALID, ARGUMENTS, END = 84, 96, 112, 128
_BYTE_ALIGNMENT = 64
_INCOHERENT = 0  # RTC_RAY_QUERY_FLAG_INCOHERENT
_ALL = -1  # every bit
_NONE = -1  # RTC_INVALID_GEOMETRY_ID

Packet = tuple[NDArray[np.float32], NDArray[np.int32]]


class _OfThread(threading.local):
    """The block of memory of a thread."""

    packet: Packet | None = None


_own = _OfThread()


def own_packet() -> Packet:
    """Return the block of memory of this thread, as float32 and as int32 words, with all set that stays the same."""
    if _own.packet is None:
        _own.packet = _new_packet()
    return _own.packet


def _new_packet() -> Packet:
    room = np.zeros(4 * END + _BYTE_ALIGNMENT, np.uint8)
    at = -room.ctypes.data % _BYTE_ALIGNMENT
    block = room[at : at + 4 * END]
    words = block.view(np.int32)
    words[MASK : MASK + LANES] = _ALL
    words[VALID : VALID + 1 + COMPANIONS] = _ALL
    words[ARGUMENTS : ARGUMENTS + 2] = _INCOHERENT, _ALL  # flags, and every feature
    return block.view(np.float32), words


@njit(cache=True, forceinline=True, uncounted=True)
def put_ray(floats, words, lane, x, y, z, along):  # type: ignore[no-untyped-def]
    """Write one ray into the packet: origin x, y, z [m], direction `along` (3,)."""
    floats[ORIGIN + lane], floats[ORIGIN + LANES + lane], floats[ORIGIN + 2 * LANES + lane] = x, y, z
    floats[DIRECTION + lane], floats[DIRECTION + LANES + lane] = along[0], along[1]
    floats[DIRECTION + 2 * LANES + lane] = along[2]
    floats[FAR + lane] = np.inf
    words[PRIMITIVE + lane] = words[GEOMETRY + lane] = words[INSTANCE + lane] = _NONE


@njit(cache=True, forceinline=True, uncounted=True)
def first_triangles(intersect, scene, words):  # type: ignore[no-untyped-def]
    """Return the numbers of the triangles that the packet's rays meet first, -1 for none.

    Args: intersect address of rtcIntersect4; scene address of Embree's scene.
    """
    at = np.intp(words.ctypes.data)
    call(intersect, at + 4 * VALID, scene, at, at + 4 * ARGUMENTS)
    return words[PRIMITIVE], words[PRIMITIVE + 1], words[PRIMITIVE + 2]
