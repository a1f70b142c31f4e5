"""Compilation of a kernel together with all that it calls, as one piece of machine code.

numba by itself optimises every function and generates its machine code, and does so again within each
function that calls it. Most kernels are called by other kernels alone. Here they stay modules of LLVM, which
the kernel that Python calls links once each. That takes half the time and memory.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from typing import Any


def compile_whole(function: Callable[..., Any], types: tuple[Any, ...], options: dict[str, Any]) -> Any:
    """The CompileResult of a function for arguments of these numba types. It has no machine code yet."""
    import numba

    njit: Any = numba.njit
    with _modules_alone():
        (compiled,) = njit([types], no_cfunc_wrapper=True, **options)(function).overloads.values()
    return compiled


def link_and_optimise(compiled: Any) -> tuple[Any, bytes]:
    """The module of a kernel with all that it calls, and its machine code."""
    library = compiled.library
    library.link_called()
    library.optimise()
    module = library._final_module
    return module, library._codegen._tm.emit_object(module)


@contextlib.contextmanager
def _modules_alone() -> Iterator[None]:
    """What numba compiles in this block stays modules of LLVM."""
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.registry import cpu_target

    with global_compiler_lock:
        target: Any = cpu_target.target_context
        before, target._internal_codegen = target._internal_codegen, _code_generator()
        try:
            yield
        finally:
            target._internal_codegen = before


@functools.cache
def _code_generator() -> Any:
    """A code generator of numba that generates no machine code."""
    import numba.core.codegen

    numba_code: Any = numba.core.codegen

    class ModuleLibrary(numba_code.JITCodeLibrary):  # type: ignore[misc]
        """The LLVM module of one function, and the libraries of those that it calls."""

        def finalize(self) -> None:
            """Nothing more can be added. It is linked and optimised as part of what calls it."""
            self._finalize_dynamic_globals()
            self._finalized = True

        def get_pointer_to_function(self, name: str) -> int:
            """There is no machine code to call: a null pointer."""
            return 0

        def link_called(self) -> None:
            """Link the modules of all that is called, directly or not."""
            own = {each.name for each in self.get_defined_functions()}
            linked, left = {self}, self._linking_libraries[::-1]
            while left:
                called = left.pop()
                if called in linked:
                    continue
                linked.add(called)
                if isinstance(called, ModuleLibrary):
                    self._final_module.link_in(called._final_module, preserve=True)
                    left += called._linking_libraries[::-1]
                else:
                    self._final_module.link_in(called._get_module_for_linking(), preserve=True)
            for function in self.get_defined_functions():
                # Once it is inlined everywhere it can be dropped.
                if function.name not in own and function.linkage.name == "external":
                    function.linkage = "linkonce_odr"

        def optimise(self) -> None:
            """Optimise the linked module as numba does."""
            self._optimize_final_module()
            self._final_module.verify()

        @functools.cached_property
        def _linked_module(self) -> Any:
            whole = type(self)(self._codegen, self.name)
            whole._linking_libraries = [self]
            whole.link_called()
            return whole._final_module

        def _get_module_for_linking(self) -> Any:
            """The module for functions of others, which may call this one of numba's."""
            return self._linked_module

    class ModuleGenerator(numba_code.JITCPUCodegen):  # type: ignore[misc]
        """Makes libraries without machine code."""

        _library_class = ModuleLibrary

        def set_env(self, env_name: str, env: Any) -> None:
            """Machine code, which holds an address of `env`, is made later."""

    return ModuleGenerator("nscan_cli.kernels")
