"""Code that is only linked into the code of others: no machine code is made of it until something asks for it.

Numba optimises every function with all that it calls and makes machine code of it at once, also of those that only
compiled functions call, and copies the code of these into each caller, to be optimised there again. Here that is done
once, where machine code is made. This rests on how numba's `JITCodeLibrary` is built; with a version of numba that it
was not tested with, numba makes machine code of everything.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import llvmlite.binding as llvm
import numba
from llvmlite.binding.newpassmanagers import create_new_module_pass_manager
from numba.core.cgutils import normalize_ir_text
from numba.core.codegen import JITCodeLibrary
from numba.core.environment import lookup_environment

_TESTED = "0.68."  # to raise it: tests/compile with the new version, and code of a cold run that keeps its results
FITS = numba.__version__.startswith(_TESTED)  # this and `compile.typing_memo` may reach into numba
_ENVIRONMENT = "_ZN08NumbaEnv"
_WRAPPER = "_ZN7cpython"


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc,no-any-unimported]
    """The code of a function, made into machine code when the address of one of its functions is asked for."""

    _made = False

    def add_ir_module(self, ir_module: Any) -> None:
        """Add code; what takes arguments from Python stays as it is, without a copy of the function inside."""
        for function in ir_module.functions:
            if function.name.startswith(_WRAPPER) and not function.is_declaration:
                function.attributes.add("noinline")
                function.attributes.add("optnone")
        code = llvm.parse_assembly(normalize_ir_text(str(ir_module)))
        code.name = ir_module.name
        self.add_llvm_module(code)  # numba verifies it here, too; all is verified once more at the end

    def _optimize_functions(self, ll_module: Any) -> None:
        """Optimise each function by itself, at LLVM's first level (5 % of compiling): all are optimised once more with
        their callers. Numba sets up all passes for functions too of which only the name is there, most of them."""
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager(opt=1)
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        """Remove what nothing reads: numba does not keep code that names addresses of this process."""
        passes = create_new_module_pass_manager()
        passes.add_global_dead_code_eliminate_pass()
        passes.run(self._final_module, self._codegen._pass_builder())

    def _finalize_final_module(self) -> None:
        if getattr(self, "_compiled_object", None) is not None:  # from the cache
            self._made = True
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, 0 if the code has none of this name."""
        self._ensure_finalized()
        if not self._made and self._defines(name):
            self._made = True
            super()._optimize_final_module()
            super()._finalize_final_module()
            self._set_environments()
        return super().get_pointer_to_function(name) if self._made else 0  # type: ignore[no-any-return]

    def _defines(self, name: str) -> bool:
        try:
            return not self._final_module.get_function(name).is_declaration
        except NameError:
            return False

    def _set_environments(self) -> None:
        """Tell the machine code where the environments lie of the functions that were linked into it."""
        for variable in self._final_module.global_variables:
            if variable.name.startswith(_ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    self.codegen.set_env(variable.name, environment)

    @property
    def codegen(self) -> Any:
        """The generator of code; this library itself, which has nowhere to set an environment, without machine code."""
        return self._codegen if self._made else self

    def set_env(self, name: str, environment: Any) -> None:
        """Leave an environment to the code that this is linked into."""

    def serialize_using_object_code(self) -> tuple[Any, ...]:
        """Return what the cache keeps: machine code only where there is any."""
        return super().serialize_using_object_code() if self._made else self.serialize_using_bitcode()  # type: ignore[no-any-return]


@contextlib.contextmanager
def machine_code_where_called(target: Any) -> Iterator[None]:
    """Compile for a target, within the block, to machine code only what is called from outside compiled code; numba's
    own functions get no wrapper for calls from C."""
    if not FITS or target.codegen()._library_class is LinkedLibrary:
        yield
        return
    codegen, usual = target.codegen(), target.codegen()._library_class
    codegen._library_class = LinkedLibrary
    target.create_cfunc_wrapper = _no_wrapper
    try:
        yield
    finally:
        codegen._library_class = usual
        del target.create_cfunc_wrapper


def _no_wrapper(*_: Any) -> None:
    """Nothing calls compiled code by its address from C."""
