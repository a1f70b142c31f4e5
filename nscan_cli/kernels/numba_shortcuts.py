"""Shortcuts in the work of numba itself, in effect while kernels are compiled.

numba makes the modules of LLVM in Python, which takes two thirds of the time to compile. Some of this work is
for nothing, or the same again and again. A shortcut gives what numba's own function gives.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from typing import Any, cast


@contextlib.contextmanager
def numba_shortcuts() -> Iterator[None]:
    """In this block numba takes the shortcuts. A numba without one of these functions goes its own way."""
    with contextlib.ExitStack() as stack:
        for owner, name, shortcut in _shortcuts():
            stack.callback(setattr, owner, name, vars(owner)[name])
            setattr(owner, name, shortcut)
        yield


@functools.cache
def _shortcuts() -> list[tuple[Any, str, Callable[..., Any]]]:
    """Classes of numba, the names of their methods, and what takes their place."""
    try:
        from numba.core import ir
        from numba.core.base import BaseContext
        from numba.core.postproc import PostProcessor
        from numba.core.runtime.context import NRTContext
        from numba.core.types.functions import BaseFunction
        from numba.core.typing.context import BaseContext as TypingContext
    except ImportError:
        return []
    made = (
        (NRTContext, "get_meminfos", _counted_parts),
        (ir.Inst, "_rec_list_vars", _listed_variables),
        (BaseFunction, "get_call_type", _remembered_signatures),
        (PostProcessor, "run", _without_live_variables),
        (TypingContext, "refresh", _refreshed_if_new),
        (BaseContext, "refresh", _refreshed_if_new),
        (BaseContext, "get_abi_sizeof", _remembered_sizes),
        (BaseContext, "get_abi_alignment", _remembered_sizes),
    )
    return [(owner, name, make(vars(owner)[name])) for owner, name, make in made if name in vars(owner)]


def _counted_parts(_own: Callable[..., Any]) -> Callable[..., Any]:
    """The parts of a value whose references are counted, without a look at the other parts.

    numba takes all parts out of an array, and of each array in a tuple. Three quarters of the instructions of
    a kernel that takes many arrays did that, and were removed by LLVM.
    """
    counted: dict[Any, bool] = {}

    def get_meminfos(self: Any, builder: Any, kind: Any, value: Any) -> list[tuple[Any, Any]]:
        models = self._context.data_model_manager
        model = models[kind]
        found = [(kind, model.get_nrt_meminfo(builder, value))] if model.has_nrt_meminfo() else []
        for part, taken_from in model.traverse(builder):
            if part not in counted:
                counted[part] = models[part].contains_nrt_meminfo()
            if counted[part]:
                found += get_meminfos(self, builder, part, taken_from(value))
        return found

    return get_meminfos


def _listed_variables(_own: Callable[..., Any]) -> Callable[..., Any]:
    """The variables of an instruction, without asking of each name and number whether it holds some."""
    from numba.core import ir

    leaf, variable, instruction, sequence, mapping = range(5)
    kinds: dict[type, int] = {}

    def kind_of(each: type) -> int:
        bases = (ir.Var, variable), (ir.Inst, instruction), ((list, tuple), sequence), (dict, mapping)
        kinds[each] = next((kind for base, kind in bases if issubclass(each, base)), leaf)
        return kinds[each]

    def list_variables(self: Any, value: Any) -> list[Any]:
        kind = kinds.get(type(value))
        if kind is None:
            kind = kind_of(type(value))
        if kind == leaf:
            return []
        if kind == variable:
            return [value]
        if kind == instruction:
            return list(value.list_vars())
        found = []
        for part in value if kind == sequence else value.values():
            if kinds.get(type(part)) != leaf:
                found += list_variables(self, part)
        return found

    return list_variables


def _remembered_signatures(own: Callable[..., Any]) -> Callable[..., Any]:
    """The signature of a function of numba's for some types, found once.

    numba tries all forms of an operator again wherever a kernel uses it, twenty times each on average.
    """
    signatures: dict[Any, Any] = {}

    def get_call_type(self: Any, context: Any, arguments: Any, named: dict[str, Any]) -> Any:
        key = self, context, arguments, tuple(named.items())
        if key not in signatures:
            signatures[key] = own(self, context, arguments, named)
        return signatures[key]

    return get_call_type


def _without_live_variables(own: Callable[..., Any]) -> Callable[..., Any]:
    """What follows a pass over a function, without the variables that each block finds there.

    numba lists them nine times for each function. Only generators and Python's objects need them.
    """
    from numba.core import postproc, transforms

    canonical, lifetime = cast(Any, transforms).canonicalize_cfg, cast(Any, postproc).VariableLifetime

    def run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        function = self.func_ir
        if emit_dels or function.is_generator:
            own(self, emit_dels, extend_lifetimes)
            return
        function.blocks = canonical(function.blocks)
        function.variable_lifetime = lifetime(function.blocks)
        function.generator_info = None

    return run


def _remembered_sizes(own: Callable[..., Any]) -> Callable[..., Any]:
    """The size or alignment of a type, found once. numba has LLVM read a module for each question."""
    sizes: dict[str, int] = {}

    def size(self: Any, kind: Any) -> int:
        text = str(kind)
        if text not in sizes:
            sizes[text] = own(self, kind)
        return sizes[text]

    return size


def _refreshed_if_new(own: Callable[..., Any]) -> Callable[..., Any]:
    """A look for new functions in numba's registries, if there are any. numba imports and looks through them
    a dozen times for each function."""
    entries: dict[int, int] = {}

    def refresh(self: Any) -> None:
        registries, typing = self._registries, getattr(self, "typing_context", None)
        if entries.get(id(registries)) != _entries(registries):
            own(self)
            entries[id(registries)] = _entries(registries)
        elif typing is not None:
            typing.refresh()

    return refresh


def _entries(registries: Any) -> int:
    return sum(len(each) for one in registries for each in vars(one).values() if isinstance(each, list))
