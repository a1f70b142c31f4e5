"""`kernel`, the decorator of compiled functions: machine code as kept in the cache folder, or made by numba.

numba keeps what it has compiled one by one, too: it saves compiling anew what two kernels call.
"""

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

Function = TypeVar("Function", bound=Callable[..., Any])

C_ORDER, FORTRAN_ORDER, ALIGNED_AND_WRITEABLE = 1, 2, 0x500
"""Bits of the flags of an array."""
IN_C_ORDER, NOT_IN_C_ORDER = ALIGNED_AND_WRITEABLE | C_ORDER, ALIGNED_AND_WRITEABLE | FORTRAN_ORDER
"""What of them counts. What is in both orders, as all that has one axis, is in C's."""
LOOK = operator.attrgetter("dtype", "ndim", "flags.num")
"""Of an array. Flags that do not count are among them."""
LOCK = threading.RLock()
"""Held while kernels are loaded or made."""
TO_BE_TOLD: list[Callable[[], None]] = []
"""Who wants to know that this process compiles."""


def bring_up() -> None:
    """Load what runs kernels, for a command that will need it: what comes before may use kernels, too."""
    # Another numba than is known, which keeps its code itself, can raise anything.
    with LOCK, contextlib.suppress(Exception):
        machine_code.engine()


def are_up() -> bool:
    """Whether kernels run in this process already: LLVM takes room that reading alone may not have."""
    return machine_code.engine.cache_info().currsize > 0


def tell_when_compiling(tell: Callable[[], None] | None) -> None:
    """Have `tell` called once, just before this process compiles a kernel; None: nobody wants to know."""
    TO_BE_TOLD[:] = [] if tell is None else [tell]


def _tell() -> None:
    while TO_BE_TOLD:
        TO_BE_TOLD.pop()()


def kernel(function: Function) -> Function:
    """Compile `function` at its first call with numba, or load its machine code from the cache folder.

    No parallel loops, and of fastmath only fused multiply-adds, which change no order: the same bytes come
    out on any number of threads. The interpreter's lock is released, so threads can share the work.
    """
    return cast(Function, Kernel(function, {"contract"}))


def leaf_kernel(function: Function) -> Function:
    """The same for what is called in the loops of other kernels: it makes no arrays.

    It counts no references to the arrays that it is given: in a loop that takes longer than the work.
    """
    return cast(Function, Kernel(function, {"contract"}, _nrt=False))


def unfolded_kernel(function: Function) -> Function:
    """A lean kernel whose machine code becomes part of its callers', however long: it may take many arrays.

    To hand over the arrays of an NDT takes a hundred machine words a call.
    """
    return cast(Function, Kernel(function, {"contract"}, _nrt=False, forceinline=True))


def forceinline_kernel(function: Function) -> Function:
    """The same for what gives lean kernels a part of their arrays: it becomes part of them."""
    return cast(Function, Kernel(function, {"contract"}, inline="always"))


def reduction_kernel(function: Function) -> Function:
    """A lean kernel whose loop does nothing but sum: its terms may be summed in lanes, side by side.

    How many lanes there are depends on the processor, on nothing else.
    """
    return cast(Function, Kernel(function, {"contract", "reassoc", "nsz"}, _nrt=False))


class Kernel:
    """A function that takes arrays, numbers and tuples of them, and runs as machine code."""

    def __init__(self, function: Callable[..., Any], fastmath: set[str], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._options = {"nogil": True, "error_model": "numpy", "fastmath": fastmath, **options}
        self._versions: dict[object, Callable[..., Any]] = {}
        """By the kinds of the arguments; by their looks, of which several are of the same kinds, below."""
        self._by_looks: dict[object, Callable[..., Any]] = {}
        self._called_by_kernels: Any = None

    def __call__(self, *arguments: Any) -> Any:
        """What the function returns."""
        looks = tuple([LOOK(each) if type(each) is np.ndarray else _look(each) for each in arguments])
        version = self._by_looks.get(looks)
        if version is None:
            version = self._by_looks[looks] = self._by_kinds(arguments)
        return version(*arguments)

    def _by_kinds(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """The kernel for such arguments, which may be there already."""
        kinds = tuple([_kind(argument) for argument in arguments])
        with LOCK:
            if kinds not in self._versions:
                self._versions[kinds] = self._version(kinds, arguments)
            return self._versions[kinds]

    def _version(self, kinds: object, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """The kernel for arguments of these kinds."""
        file = machine_code.kept_in(f"{self.py_func.__module__}.{self.py_func.__qualname__}", kinds)
        if file is None:
            return cast(Callable[..., Any], self.dispatcher)
        version = machine_code.load(file, self.py_func.__name__)
        if version is None:
            _tell()
            made = self._dispatcher(arguments)
            (compiled,) = made.overloads.values()
            # Another process may have been first.
            version = machine_code.keep(file, self.py_func.__name__, compiled) or made
        return cast(Callable[..., Any], version)

    @property
    def dispatcher(self) -> Any:
        """What numba makes of the function, with numba's own cache: for the kernels that call it."""
        with LOCK:
            if self._called_by_kernels is None:
                self._called_by_kernels = self._dispatcher()
                _forgive(getattr(self._called_by_kernels, "_cache", None))
        return self._called_by_kernels

    def _dispatcher(self, arguments: tuple[Any, ...] | None = None) -> Any:
        """A function of numba's that compiles this one at its call, or now and only for these arguments."""
        numba = _numba()
        config: Any = numba.config
        folder = cache_folder() if arguments is None else None
        signature = None if arguments is None else [tuple(map(numba.typeof, arguments))]
        # numba picks a function's folder when it is decorated: other users of numba in this process keep
        # theirs.
        own = "" if folder is None else str(folder / machine_code.vector_library())
        configured, config.CACHE_DIR = config.CACHE_DIR, own
        try:
            return numba.njit(signature, cache=folder is not None, **self._options)(self.py_func)
        finally:
            config.CACHE_DIR = configured

    @property
    def _numba_type_(self) -> Any:
        """What numba takes a kernel for that another one calls."""
        return self.dispatcher._numba_type_

    @property
    def targetoptions(self) -> Any:
        """Where numba looks whether the kernel becomes part of the one that calls it."""
        return self.dispatcher.targetoptions


def _numba() -> Any:
    """numba; where it comes in here, without the vector library that a machine may have.

    With that, sines would round otherwise than on other machines, and kept code would need it.
    """
    switch = "NUMBA_DISABLE_INTEL_SVML"
    before, os.environ[switch] = os.environ.get(switch), "1"
    try:
        import numba

        return numba
    finally:
        if before is None:
            del os.environ[switch]
        else:
            os.environ[switch] = before


def _look(value: Any) -> object:
    """What tells arguments of other kinds apart, and can be had in less time than the kind."""
    if isinstance(value, np.ndarray):
        return LOOK(value)
    if isinstance(value, tuple):
        return type(value), *[LOOK(each) if type(each) is np.ndarray else _look(each) for each in value]
    return type(value)


def _kind(value: Any) -> object:
    """What of an argument its machine code depends on."""
    if isinstance(value, np.ndarray):
        flags = value.flags.num
        return value.dtype, value.ndim, flags & (IN_C_ORDER if flags & C_ORDER else NOT_IN_C_ORDER)
    if isinstance(value, tuple):
        return type(value), *[_kind(each) for each in value]
    if isinstance(value, float):
        return float
    if value is None or isinstance(value, (int, np.generic)):
        return type(value)
    raise TypeError(f"kernels take arrays, numbers and tuples of them, not {type(value).__name__}")


def _forgive(cache: Any) -> None:
    """Let no folder that is full or damaged stop the work: what cannot be loaded is compiled anew."""
    if cache is None:
        return
    load, save = cache.load_overload, cache.save_overload

    def load_if_sound(*call: Any) -> Any:
        loaded = None
        try:
            loaded = load(*call)
        except Exception:
            # What is damaged can raise anything. An empty index takes its place.
            with contextlib.suppress(Exception):
                cache.flush()
        if loaded is None:
            _tell()
        return loaded

    def save_if_possible(*call: Any) -> None:
        with contextlib.suppress(OSError):
            save(*call)

    cache.load_overload, cache.save_overload = load_if_sound, save_if_possible
