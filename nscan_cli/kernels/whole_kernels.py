"""Compilation of a kernel together with all that it calls, as one piece of machine code.

numba by itself optimises every function and generates its machine code, and does so again within each
function that calls it. Most kernels are called by other kernels alone. Here they stay modules of LLVM, which
the kernel that Python calls links once each. That takes half the time and memory.
"""

from __future__ import annotations

import contextlib
import functools
import gc
from collections.abc import Iterator
from typing import Any, cast

from nscan_cli.kernels.numba_shortcuts import numba_shortcuts

COLLECTION_THRESHOLDS = 50_000, 20, 1_000_000
"""New objects before a collection of garbage, such collections before one of older objects, and of these
before a full one: more than there are in a process."""


def dispatcher_for_kernels(function: Any, options: dict[str, Any]) -> Any:
    """numba's dispatcher of a function for calls from kernels. Python cannot call it.

    numba would compile it again for each constant that kernels pass. Here a constant is a number like any
    other.
    """
    import numba
    import numba.core.types

    njit, unliteral = cast(Any, numba.njit), cast(Any, numba.core.types.unliteral)
    dispatcher = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)(function)
    template = dispatcher.get_call_template

    def template_for_numbers(arguments: Any, named: dict[str, Any]) -> Any:
        numbers = {name: unliteral(argument) for name, argument in named.items()}
        return template(tuple(map(unliteral, arguments)), numbers)

    dispatcher.get_call_template = template_for_numbers
    return dispatcher


def compile_whole(dispatcher: Any, types: tuple[Any, ...]) -> Any:
    """The CompileResult for arguments of these numba types, with a function that Python can call.

    `dispatcher` is of `dispatcher_for_kernels`; what a kernel has called is not compiled again for Python.
    There is no machine code yet.
    """
    from numba.core.registry import cpu_target

    options, target = dispatcher.targetoptions, cast(Any, cpu_target.target_context)
    with _modules_alone(), rare_collections(), numba_shortcuts():
        dispatcher.get_call_template(types, {})
        called = dispatcher.overloads[types]
        context = target.subtarget(enable_nrt=options.get("_nrt", True))
        library = context.codegen().create_library(called.library.name)
        library.add_linking_library(called.library)
        with context.push_code_library(library):
            context.create_cpython_wrapper(
                library, called.fndesc, called.environment, called.call_helper, options["nogil"]
            )
        library.finalize()
    return called._replace(library=library)


@contextlib.contextmanager
def rare_collections() -> Iterator[None]:
    """In this block the garbage collector works seldom, and on young objects alone.

    numba makes millions of objects that stay. To look at all of them again and again takes a fifth of the
    time, and finds little garbage. Without any collection it would take twice the memory.
    """
    before = gc.get_threshold()
    gc.set_threshold(*COLLECTION_THRESHOLDS)
    try:
        yield
    finally:
        gc.set_threshold(*before)


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

        def _optimize_functions(self, ll_module: Any) -> None:
            """Optimise the functions of a module one by one, at level 1, before the module is linked.

            Level 3 takes 4 % longer here and changes nothing in the end. numba also makes passes for
            functions that a module only declares.
            """
            ll_module.data_layout = self._codegen._data_layout
            for function in ll_module.functions:
                if not function.is_declaration:
                    manager, builder = self._codegen._function_pass_manager(opt=1)
                    manager.run(function, builder)

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
            """Optimise the whole of the linked module, as numba does."""
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
