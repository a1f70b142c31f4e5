"""`kernel`, the decorator of compiled functions: it loads cached machine code, or has numba compile it."""

from __future__ import annotations

import contextlib
import functools
import operator
import os
import threading
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np

from nscan_cli.kernels import machine_code
from nscan_cli.kernels.cache_folder import cache_folder
from nscan_cli.kernels.compile_lock import compile_lock
from nscan_cli.kernels.whole_kernels import compile_whole, dispatcher_for_kernels

Function = TypeVar("Function", bound=Callable[..., Any])

C_ORDER, FORTRAN_ORDER, ALIGNED_AND_WRITEABLE = 1, 2, 0x500
"""Bits of the flags of an array."""
C_ORDER_FLAGS, OTHER_ORDER_FLAGS = ALIGNED_AND_WRITEABLE | C_ORDER, ALIGNED_AND_WRITEABLE | FORTRAN_ORDER
"""The flags that machine code depends on. An array in both orders, such as one of one axis, is in C order."""
ARRAY_KEY = operator.attrgetter("dtype", "ndim", "flags.num")
"""The fingerprint of an array. It has more flags than machine code depends on."""
COMPILE_LOCK = threading.RLock()
"""Held while kernels are loaded or compiled."""
COMPILE_CALLBACKS: list[Callable[[], None]] = []
"""Called once before this process compiles its next kernel."""


def load_runtime() -> None:
    """Load what runs kernels. Commands that need it call this before reading, which then uses kernels."""
    # A numba that this version does not know can raise anything. It then uses its own cache.
    with COMPILE_LOCK, contextlib.suppress(Exception):
        machine_code.runtime()


def runtime_is_loaded() -> bool:
    """Whether this process has loaded what runs kernels. For reading alone it takes too much memory."""
    return machine_code.runtime.cache_info().currsize > 0


def on_first_compile(callback: Callable[[], None] | None) -> None:
    """Call `callback` once, just before this process compiles a kernel; None removes it."""
    COMPILE_CALLBACKS[:] = [] if callback is None else [callback]


def _announce_compile() -> None:
    while COMPILE_CALLBACKS:
        COMPILE_CALLBACKS.pop()()


def kernel(function: Function) -> Function:
    """Compile `function` with numba at its first call, or load its machine code from the cache folder.

    There are no parallel loops, and of fastmath only fused multiply-adds, which keep the order of sums. So
    results do not depend on the number of threads. The GIL is released, so threads can share the work.
    """
    return cast(Function, Kernel(function, {"contract"}))


def leaf_kernel(function: Function) -> Function:
    """A kernel that other kernels call in their loops. It must not make arrays.

    It does not count references to its arguments (numba's `_nrt=False`), which would take longer than its
    work.
    """
    return cast(Function, Kernel(function, {"contract"}, _nrt=False))


def llvm_inline_kernel(function: Function) -> Function:
    """A leaf kernel that LLVM always inlines (numba's `forceinline=True`), however long it is.

    For kernels that take many arrays: to pass the arrays of an NDT takes a hundred machine words a call.
    """
    return cast(Function, Kernel(function, {"contract"}, _nrt=False, forceinline=True))


def numba_inline_kernel(function: Function) -> Function:
    """A kernel that numba inlines before typing (`inline="always"`), for one that returns views of arrays."""
    return cast(Function, Kernel(function, {"contract"}, inline="always"))


def reduction_kernel(function: Function) -> Function:
    """A leaf kernel whose loop only sums. The compiler may vectorise it, which changes the order of the sum.

    The number of vector lanes depends on the processor alone.
    """
    return cast(Function, Kernel(function, {"contract", "reassoc", "nsz"}, _nrt=False))


class Kernel:
    """A function that takes arrays, numbers and tuples of them, and runs as machine code."""

    def __init__(self, function: Callable[..., Any], fastmath: set[str], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._options = {"nogil": True, "error_model": "numpy", "fastmath": fastmath, **options}
        self.specialisations: dict[object, Callable[..., Any]] = {}
        """Compiled functions by the types of the arguments (`_type_key`)."""
        self.by_fingerprint: dict[object, Callable[..., Any]] = {}
        """The same functions by the fingerprints of the arguments, which are faster to take."""

    def __call__(self, *arguments: Any) -> Any:
        """What the function returns."""
        key = tuple(
            [ARRAY_KEY(each) if type(each) is np.ndarray else _fingerprint(each) for each in arguments]
        )
        compiled = self.by_fingerprint.get(key)
        if compiled is None:
            compiled = self.by_fingerprint[key] = self._specialisation(arguments)
        return compiled(*arguments)

    def _specialisation(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """The compiled function for arguments of these types, which is made if there is none yet."""
        types = tuple([_type_key(argument) for argument in arguments])
        with COMPILE_LOCK:
            if types not in self.specialisations:
                self.specialisations[types] = self._load_or_compile(types, arguments)
            return self.specialisations[types]

    def _load_or_compile(self, types: object, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        file = machine_code.code_file(f"{self.py_func.__module__}.{self.py_func.__qualname__}", types)
        if file is None:
            return cast(Callable[..., Any], self.dispatcher)
        loaded = machine_code.load(file, self.py_func.__name__)
        if loaded is None:
            with compile_lock(file):
                # Another process may have compiled it meanwhile.
                loaded = machine_code.load(file, self.py_func.__name__)
                if loaded is None:
                    _announce_compile()
                    loaded = machine_code.save(file, self.py_func.__name__, lambda: self._compile(arguments))
        return cast(Callable[..., Any], loaded or self.dispatcher)

    def _compile(self, arguments: tuple[Any, ...]) -> Any:
        """numba's CompileResult for arguments of these types."""
        types = tuple(map(_import_numba().typeof, arguments))
        return compile_whole(self._called, types)

    @functools.cached_property
    def dispatcher(self) -> Any:
        """numba's dispatcher of the function with numba's own cache, for where no machine code is cached."""
        numba = _import_numba()
        config: Any = numba.config
        folder = cache_folder()
        # numba reads its cache folder when it decorates. It is restored for other users of numba.
        own = "" if folder is None else str(folder / machine_code.vector_library())
        configured, config.CACHE_DIR = config.CACHE_DIR, own
        try:
            dispatcher = numba.njit(cache=folder is not None, **self._options)(self.py_func)
        finally:
            config.CACHE_DIR = configured
        _tolerate_broken_cache(getattr(dispatcher, "_cache", None))
        return dispatcher

    @functools.cached_property
    def _called(self) -> Any:
        """numba's dispatcher of the function in kernels that call it. Python cannot call this one."""
        _import_numba()
        return dispatcher_for_kernels(self.py_func, self._options)

    @property
    def _numba_type_(self) -> Any:
        """The numba type of this kernel in one that calls it."""
        return self._called._numba_type_

    @property
    def targetoptions(self) -> Any:
        """The options in which numba looks for `inline`."""
        return self._called.targetoptions


def _import_numba() -> Any:
    """numba, imported without Intel's vector library (SVML) and colours, if this is the first import.

    With SVML, sines round differently than on other machines, and cached code needs the library. With
    colours (where colorama is installed) numba marks up messages that nobody sees: 2 % of a compilation.
    """
    before = {name: os.environ.get(name) for name in machine_code.IMPORT_SWITCHES}
    os.environ.update(dict.fromkeys(before, "1"))
    try:
        import numba

        return numba
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _fingerprint(value: Any) -> object:
    """A key that differs wherever `_type_key` differs, and takes less time."""
    if isinstance(value, np.ndarray):
        return ARRAY_KEY(value)
    if isinstance(value, tuple):
        return type(value), *[
            ARRAY_KEY(each) if type(each) is np.ndarray else _fingerprint(each) for each in value
        ]
    return type(value)


def _type_key(value: Any) -> object:
    """What machine code depends on of an argument. Raises TypeError for what no kernel takes."""
    if isinstance(value, np.ndarray):
        flags = value.flags.num
        return value.dtype, value.ndim, flags & (C_ORDER_FLAGS if flags & C_ORDER else OTHER_ORDER_FLAGS)
    if isinstance(value, tuple):
        return type(value), *[_type_key(each) for each in value]
    if isinstance(value, float):
        return float
    if value is None or isinstance(value, (int, np.generic)):
        return type(value)
    raise TypeError(f"kernels take arrays, numbers and tuples of them, not {type(value).__name__}")


def _tolerate_broken_cache(cache: Any) -> None:
    """Keep a full or damaged cache folder from stopping the work: what cannot be loaded is compiled again."""
    if cache is None:
        return
    load, save = cache.load_overload, cache.save_overload

    def load_if_sound(*call: Any) -> Any:
        loaded = None
        try:
            loaded = load(*call)
        except Exception:
            # A damaged file can raise anything. Its index is emptied.
            with contextlib.suppress(Exception):
                cache.flush()
        if loaded is None:
            _announce_compile()
        return loaded

    def save_if_possible(*call: Any) -> None:
        with contextlib.suppress(OSError):
            save(*call)

    cache.load_overload, cache.save_overload = load_if_sound, save_if_possible
