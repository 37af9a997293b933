"""`njit`: numba's, with a cache on disk that notices when anything changes from which code was compiled.

Numba's own cache looks at the file of a function only. The functions that it calls from other files, and the constants
that it takes from them, are compiled into it too: after a change there numba would go on using the old code. Which
files the cache writes, and how processes share them, is in `compile.code_cache`.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import operator
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import config
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import OmittedArg
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature

from raychan.compile.code_cache import CodeCache, unkept
from raychan.compile.linked import FITS, machine_code_where_called
from raychan.compile.quick_numba import quick_numba
from raychan.compile.returned import arrays_at_once
from raychan.compile.typing_memo import remembered_typing

_CHECKED, _UNCOMPILED = (bool(getattr(config, name)) for name in ("BOUNDSCHECK", "DISABLE_JIT"))
_CONSTANTS = int, float, complex, str, tuple

# How code is made here, on which all of it depends too.
_HOW = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))).digest()

KERNELS: list[Kernel] = []  # all that are cached on disk, as their modules are imported
_compiling: list[Kernel] = []  # those being compiled, each for the one before it


class Kernel(CPUDispatcher):  # type: ignore[no-any-unimported]
    """A compiled function. Called from Python, it takes read-only arrays as writable ones: numba would compile it once
    more for every mixture of both.

    With bounds checked (NUMBA_BOUNDSCHECK=1) a call that changes a read-only array raises ValueError.
    """

    kept: CodeCache
    stamp: bytes
    served: set[tuple[int, ...]]  # codes of the types of read-only arguments that code for writable ones serves

    def _compile_for_args(self, *args: Any, **named: Any) -> Any:
        """Return the code for arguments of types that no call had before; it may write to all arrays. Later calls of
        such types go straight to it."""
        code = super()._compile_for_args(*map(_open, args), **named)
        given, opened = (tuple(self._code_of(x) for x in xs) for xs in (args, map(_open, args)))
        with global_compiler_lock:
            if given != opened and given not in self.served:
                self.served.add(given)
                self._insert(list(given), code, False)  # type: ignore[attr-defined]
        return code

    def _code_of(self, value: Any) -> int:
        """Return numba's number of an argument's type."""
        kind: Any = types.Omitted(value.value) if isinstance(value, OmittedArg) else self.typeof_pyval(value)
        return int(kind._code)

    def compile(self, sig: Any) -> Any:
        """Compile the kernel for these argument types, or wait for the process that does and take its code.

        What a compiled function calls is compiled without the wrapper that takes arguments from Python; if Python calls
        it too, it is compiled once more.
        """
        with (
            global_compiler_lock,
            self._begun() as callee,
            self.kept.held(callee),
            _uncollected(),
            machine_code_where_called(self.targetctx),
            remembered_typing(),
            quick_numba(),
            arrays_at_once(),
        ):
            arguments, _ = normalize_signature(sig)
            if not callee and arguments in self.overloads and not _wrapped(self.overloads[arguments]):
                del self.overloads[arguments]
            return super().compile(sig)

    @contextlib.contextmanager
    def _begun(self) -> Iterator[bool]:
        """Tell whether the compilation within the block is for a caller that is being compiled."""
        callee = bool(_compiling)
        _compiling.append(self)
        if callee:
            self.targetoptions["no_cpython_wrapper"] = True
        try:
            yield callee
        finally:
            self.targetoptions.pop("no_cpython_wrapper", None)
            _compiling.pop()

    def add_overload(self, compiled: Any) -> None:
        """Add compiled code, for calls from Python if it has a wrapper. Raises: TypeError if an uncounted function
        returns arrays, or one that Python calls a named tuple: the wrapper makes it by calls to Python, and does not
        look whether one of them failed, as at a Ctrl-C."""
        if not self.targetoptions.get("_nrt", True) and _held(compiled.signature.return_type):
            raise TypeError(f"{self.py_func.__qualname__} counts no references, but returns an array")
        if _wrapped(compiled):
            if _named(compiled.signature.return_type):
                raise TypeError(f"{self.py_func.__qualname__} returns a named tuple to Python")
            super().add_overload(compiled)
        else:
            self.overloads[tuple(compiled.signature.args)] = compiled


class CheckedKernel(Kernel):
    """A kernel that tells, after each call from Python, whether a read-only array is what it was."""

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Return what the kernel does. Raises: ValueError if it changes a read-only array."""
        held = [(x, zlib.crc32(x.tobytes())) for x in _read_only((*args, *named.values()))]
        found = super().__call__(*args, **named)
        if any(zlib.crc32(x.tobytes()) != was for x, was in held):
            raise ValueError(f"{self.py_func.__qualname__} writes to a read-only array")
        return found


def _read_only(values: tuple[Any, ...]) -> Iterator[np.ndarray[Any, Any]]:
    """Yield the arrays that are read-only, of values alone or in tuples."""
    for value in values:
        if isinstance(value, tuple):
            yield from _read_only(value)
        elif type(value) is np.ndarray and not value.flags.writeable:
            yield value


def _held(kind: Any) -> bool:
    """Tell whether a type is an array, or a tuple that holds one."""
    return isinstance(kind, types.Array) or any(map(_held, getattr(kind, "types", ())))


def _named(kind: Any) -> bool:
    """Tell whether a type is a named tuple, or a tuple that holds one."""
    return isinstance(kind, types.NamedTuple | types.NamedUniTuple) or any(map(_named, getattr(kind, "types", ())))


def _wrapped(compiled: Any) -> bool:
    """Tell whether Python can call compiled code."""
    return bool(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cpython_wrapper_name))


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Leave the search for cycles of garbage until the block ends: it takes an eighth of the time of compiling (74.7
    and 65.5 s of CPU for the urban street; load 3 of others; command not kept)."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return numba's `njit` with these options; with `cache`, code stays valid until the file of a compiled function
    within reach of this one changes, or a constant that it may take from elsewhere.

    With `uncounted`, for functions that neither make nor return arrays: the code counts no references to arrays, which
    it otherwise does whenever it takes one out of a tuple, or a part of one (8 tenths of the time of the shadow edges
    of an urban frame at 0.5 dB). Numba refuses such a function that makes arrays. Its caller holds all that it reads.
    """
    keep, uncounted = options.pop("cache", False), options.pop("uncounted", False)
    if FITS:
        # Always said: a function that says nothing would do as the first one does that it is compiled for.
        options["_nrt"] = not uncounted
    options.setdefault("no_cfunc_wrapper", True)  # nothing calls a kernel by its address from C

    def compiled(function: Callable[..., Any]) -> Any:
        made: Any = numba.njit(**options)(function)
        if keep and not _UNCOMPILED:
            try:
                cache = CodeCache(function)
            except RuntimeError as reason:  # no folder can be written to: every process compiles for itself
                unkept.append(str(reason))
                made.stamp = hashlib.sha256(_within_reach(function, function.__code__.co_filename)).digest()
                return made
            made.__class__ = CheckedKernel if _CHECKED else Kernel
            made._cache = made.kept = cache
            made.served = set()
            made.stamp = made.kept.stamped(hashlib.sha256(_within_reach(function, made.kept.source)).digest())
            KERNELS.append(made)
        return made

    return compiled


def _open(value: Any) -> Any:
    """Return an argument with writable views of its arrays, in tuples or alone."""
    if type(value) is np.ndarray:
        if value.flags.writeable:
            return value
    elif isinstance(value, tuple):
        opened = [_open(x) for x in value]
        if all(map(operator.is_, opened, value)):
            return value
        return tuple(opened) if type(value) is tuple else type(value)(*opened)
    else:
        return value
    seen = value.view()
    try:
        seen.flags.writeable = True
    except ValueError:  # the memory's owner is read-only itself
        return np.asarray(_Memory(value))
    return seen


class _Memory:
    """The memory of an array, without its note that it is read-only."""

    def __init__(self, held: np.ndarray[Any, Any]) -> None:
        self.held = held
        how = held.__array_interface__
        self.__array_interface__ = how | {"data": (how["data"][0], False)}


def _within_reach(function: Callable[..., Any], own: Any) -> bytes:
    """Return the stamp of a function's own file, of all that its module had imported when it was compiled, and of how
    code is made."""
    seen = [repr(own), repr(_HOW)]
    for name, value in sorted(function.__globals__.items()):
        if name.startswith("__"):
            continue
        if isinstance(value, _CONSTANTS):
            seen.append(f"{name}={value!r}")
        elif isinstance(value, np.ndarray):
            seen.append(f"{name}={value.dtype}{value.shape}{value.tobytes()!r}")
        elif getattr(value, "__module__", None) != function.__module__:
            seen.append(f"{name}:{getattr(value, 'stamp', b'')!r}" if callable(value) else name)
    return "\n".join(seen).encode()
