"""Parts of numba that do the same in less time, in their place while kernels are compiled.

Numba and llvmlite spend more than half of the time of a cold run in Python; what stands here took a tenth of it and is
either not needed or asked again and again with the same answer. None of it changes the code that numba generates. This
rests on how numba's own parts are built; with a version of numba that it was not tested with, these stay in place.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir as llvm_ir
from numba.core import ir, postproc
from numba.core.base import BaseContext
from numba.core.targetconfig import TargetConfig

from raychan.compile.linked import FITS

_Context: Any = BaseContext
_PLAIN = frozenset((str, int, float, complex, bool, type(None), ir.Loc))
_sizes: dict[tuple[Any, str], int] = {}  # of LLVM's types, by target and text


def _list_vars(_: Any, held: Any) -> list[Any]:
    """Return the variables in what an instruction holds, in order: a search that asks for the most frequent types
    first."""
    found: list[Any] = []
    for value in held.values() if type(held) is dict else (held,):
        kind = type(value)
        if kind is ir.Var:
            found.append(value)
        elif kind in _PLAIN:
            continue
        elif isinstance(value, ir.Inst):
            found.extend(value.list_vars())
        elif isinstance(value, list | tuple):
            for part in value:
                found.extend(_list_vars(None, part))
        elif isinstance(value, dict):
            found.extend(_list_vars(None, value))
    return found


def _process(processor: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Leave what is alive in which block, which numba finds out after each of nine passes, until something asks."""
    code = processor.func_ir
    if code.is_generator:
        _THEIRS["run"](processor, emit_dels, extend_lifetimes)
        return
    code.blocks = postproc.transforms.canonicalize_cfg(code.blocks)
    code.variable_lifetime = postproc.VariableLifetime(code.blocks)
    code.generator_info = None
    if emit_dels:
        processor._insert_var_dels(extend_lifetimes=extend_lifetimes)


def _same_options(one: Any, other: Any) -> Any:
    """Compare what is set before what is not, which makes two tables of all options."""
    if one is other or (type(one) is type(other) and one._values == other._values):
        return True
    return _THEIRS["__eq__"](one, other)


def _size(context: Any, kind: Any) -> int:
    """Return the size of a type, for which LLVM parses a module each time; types with names may change."""
    text = str(kind)
    if "%" in text:
        return int(_THEIRS["get_abi_sizeof"](context, kind))
    if (context, text) not in _sizes:
        _sizes[context, text] = _THEIRS["get_abi_sizeof"](context, kind)
    return _sizes[context, text]


def _get_function(context: Any, function: Any, signature: Any, _firstcall: bool = True) -> Any:
    """Find code as numba does, but for what numpy's arrays never have and numba looks for at each access to one: by
    going through all registries for what may be new."""
    return _THEIRS["get_function"](context, function, signature, _firstcall and function != "__array__")


def _write_block(block: Any, lines: list[str]) -> None:
    """Write a block of instructions, each once: numba keeps the text of each."""
    lines.append(f"{block._format_name()}:\n")
    for instruction in block.instructions:
        parts = ["  "]
        if not isinstance(instruction.type, llvm_ir.VoidType):
            parts.append(f"{instruction.get_reference()} = ")
        instruction.descr(parts)
        lines.append("".join(parts).rstrip() + "\n")


_OURS: dict[str, tuple[Any, Any]] = {
    "_rec_list_vars": (ir.Inst, _list_vars),
    "run": (postproc.PostProcessor, _process),
    "__eq__": (TargetConfig, _same_options),
    "get_abi_sizeof": (_Context, _size),
    "get_function": (_Context, _get_function),
    "descr": (llvm_ir.Block, _write_block),
}
_THEIRS: dict[str, Any] = {name: getattr(owner, name) for name, (owner, _) in _OURS.items()}


@contextlib.contextmanager
def quick_numba() -> Iterator[None]:
    """Let these parts stand in for numba's within the block; no call of LLVM is told to who counts its seconds."""
    if not FITS or postproc.PostProcessor.run is _process:
        yield
        return
    lock = llvm.ffi.lib._lock
    told, lock._cblist = lock._cblist, []
    for name, (owner, ours) in _OURS.items():
        setattr(owner, name, ours)
    try:
        yield
    finally:
        for name, (owner, _) in _OURS.items():
            setattr(owner, name, _THEIRS[name])
        lock._cblist = told
