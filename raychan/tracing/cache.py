"""What tracing computes once for a geometry and uses for all its legs; it is dropped with the geometry."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from raychan.world.geometry import Geometry

T = TypeVar("T")


class TracingCache:
    """Search structures and visibility data of one geometry; threads share it.

    No entry may hold the geometry itself: both would then live until Python's garbage collector finds the cycle.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._single: dict[Hashable, _Entry] = {}
        self._newest: dict[str, dict[Hashable, _Entry]] = {}
        self._by_leg: dict[str, WeakKeyDictionary[Any, _Entry]] = {}

    def single(self, name: str, build: Callable[[], T]) -> T:
        """Return what `build` makes, made at the first call for this name."""
        with self._lock:
            entry = self._single.setdefault(name, _Entry())
        return entry.made(build)

    def newest(self, name: str, key: Hashable, most: int, build: Callable[[], T]) -> T:
        """Return what `build` makes for a key; of each name the `most` newest are kept."""
        with self._lock:
            known = self._newest.setdefault(name, {})
            if key not in known:
                if len(known) >= most:
                    del known[next(iter(known))]
                known[key] = _Entry()
            entry = known[key]
        return entry.made(build)

    def by_leg(self, name: str, leg: Any, build: Callable[[], T]) -> T:
        """Return what `build` makes for a leg, kept as long as the leg is."""
        with self._lock:
            entry = self._by_leg.setdefault(name, WeakKeyDictionary()).setdefault(leg, _Entry())
        return entry.made(build)


class _Entry:
    """What one thread makes while others that want the same wait; others go on."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._found: Any = None
        self._known = False

    def made(self, build: Callable[[], T]) -> T:
        with self._lock:
            if not self._known:
                self._found, self._known = build(), True
            found: T = self._found
        return found


_caches: WeakKeyDictionary[Geometry, TracingCache] = WeakKeyDictionary()
_lock = threading.Lock()


def cache_of(geometry: Geometry) -> TracingCache:
    """Return the cache of a geometry."""
    with _lock:
        return _caches.setdefault(geometry, TracingCache())
