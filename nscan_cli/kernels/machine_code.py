"""A cache of numba's machine code that is loaded without importing numba.

Importing numba and loading from its own cache takes more time and memory than matching the scans of a short
log. The machine code itself needs only LLVM's loader (llvmlite) and three small libraries of numba with the
functions that it calls, for instance to turn arrays into Python objects.
"""

from __future__ import annotations

import builtins
import contextlib
import ctypes
import functools
import hashlib
import importlib
import importlib.machinery
import importlib.util
import json
import os
import re
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from nscan_cli.files.outputs import write_once
from nscan_cli.kernels.cache_folder import cache_folder
from nscan_cli.kernels.whole_kernels import link_and_optimise

IMPORT_SWITCHES = "NUMBA_DISABLE_INTEL_SVML", "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING"
"""Settings that numba is imported with."""
HARMLESS_VARIABLES = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", *IMPORT_SWITCHES}
"""Settings of numba that do not change machine code."""
NUMBA_CONFIG = ".numba_config.yaml"
"""The file in the current folder that numba reads settings from."""
SUFFIX = ".code"
"""Suffix of a file with the machine code of a kernel."""
LEFT_TO_NUMBA = ".left"
"""Suffix of an empty file that marks a kernel whose code cannot be cached here, only by numba itself."""
PICKLED_TYPE = re.compile(rb"\x80\x04\x95.{8}\x8c.([\w.]+)\x94\x8c.(\w+)\x94\x93\x94\.", re.DOTALL)
"""A class as pickle's protocol 4 writes it: the names of its module and of the class."""
UNRESOLVED: set[str] = set()
"""Symbols that cached code needed and this process lacks. Once numba is imported they may be found."""


def build_key() -> str | None:
    """Hash of what machine code depends on beside its sources: versions of the compilers, and the processor.

    None where numba's own cache is used: numba has special settings, or is a version unknown here.
    """
    toolchain = _toolchain()
    return None if toolchain is None else _short_hash((toolchain, vector_library()))


@functools.cache
def _toolchain() -> object:
    if any(name.startswith("NUMBA_") and name not in HARMLESS_VARIABLES for name in os.environ):
        return None
    if os.path.exists(NUMBA_CONFIG):
        return None
    try:
        import llvmlite
        import llvmlite.binding as llvm

        versions = sys.version, np.__version__, llvmlite.__version__, _numba_path("_version.py").read_text()
        processor = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    except Exception:
        return None
    return versions, processor


def vector_library() -> str:
    """The vector library whose functions LLVM calls in loops; "" for none.

    numba uses one if other code of this process has imported numba with it. Other processes may lack it.
    """
    config = getattr(sys.modules.get("numba"), "config", None)
    return "svml" if getattr(config, "USING_SVML", False) else ""


def code_file(name: str, types: object) -> Path | None:
    """The file for a kernel's machine code for arguments of these types; None if it is not cached here."""
    folder, build = cache_folder(), build_key()
    if folder is None or build is None:
        return None
    file = folder / f"{name}-{build}-{_short_hash(types)}{SUFFIX}"
    return None if file.with_suffix(LEFT_TO_NUMBA).exists() else file


def is_uncompiled(name: str) -> bool:
    """Whether the kernel `name` has no machine code in the cache folder."""
    folder, file = cache_folder(), code_file(name, None)
    pattern = f"*.{name}-*.nbi" if file is None else f"*.{name}-{build_key()}-*"
    return folder is None or next(folder.rglob(pattern), None) is None


def _short_hash(value: object) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()[:16]


def save(file: Path, name: str, compile_kernel: Callable[[], Any]) -> Callable[..., Any] | None:
    """Compile a kernel and write it to the file, unless that exists or there is no room.

    Returns the function, or None if its code can run only in a process that has imported numba. The file that
    is written first counts for all processes: a kernel that is compiled twice can round differently, since
    its machine code also depends on the order in which kernels are compiled.

    The file has a line of JSON with the names that the code defines and needs, a line with the CRC-32 of the
    code, and the code.
    """
    try:
        head, code = object_code(compile_kernel())
        if UNRESOLVED.intersection(head["needs"]):
            raise UnresolvedSymbolError
        data = b"%s\n%d\n%s" % (json.dumps(head).encode(), zlib.crc32(code), code)
        # Where there is no room, every process compiles.
        with contextlib.suppress(OSError):
            write_once(file, data)
            data = file.read_bytes()
        return _load_checked(data, name)
    except MemoryError:
        return None
    except Exception:
        # An unknown numba can raise anything, and its code can call what only numba has. From the next
        # process on it uses its own cache.
        with contextlib.suppress(OSError):
            file.unlink(missing_ok=True)
            file.with_suffix(LEFT_TO_NUMBA).touch()
        return None


def object_code(compiled: Any) -> tuple[dict[str, Any], bytes]:
    """The header of a compiled kernel's file, and its machine code."""
    module, code = link_and_optimise(compiled)
    declared = [each.name for each in (*module.functions, *module.global_variables) if each.is_declaration]
    description, own = compiled.fndesc, compiled.environment
    environments = {each.env_name: each for each in compiled._find_referenced_environments()}
    return {
        "function": description.llvm_cpython_wrapper_name,
        "needs": sorted(name for name in declared if not name.startswith("llvm.")),
        "environment": description.env_name,
        "constants": {
            name: [_dtype_text(value) for value in each.consts]
            for name, each in (environments | {description.env_name: own}).items()
        },
    }, code


def _dtype_text(constant: Any) -> str:
    """The text of a constant that the code uses as a Python object. Raises TypeError unless it is a dtype."""
    if not isinstance(constant, np.dtype):
        raise TypeError(constant)
    return constant.str


def load(file: Path, name: str) -> Callable[..., Any] | None:
    """The function in the file, or None if there is no file or it cannot run here.

    A file that is damaged or needs missing symbols is removed.
    """
    try:
        return _load_checked(file.read_bytes(), name)
    except (FileNotFoundError, MemoryError):
        return None
    except Exception:
        # A damaged file can raise anything. numba compiles the kernel again.
        with contextlib.suppress(OSError):
            file.unlink()
        return None


def _load_checked(data: bytes, name: str) -> Callable[..., Any]:
    text, check, code = data.split(b"\n", 2)
    if int(check) != zlib.crc32(code):
        raise ValueError("damaged")
    # It is linked once: a second copy would share symbols with the first.
    head, linked = json.loads(text), runtime().linked
    key = head["function"], check
    if key not in linked:
        linked[key] = _link(head, code, name)
    return linked[key]


class UnresolvedSymbolError(Exception):
    """Machine code needs a symbol that this process does not have."""


def _link(head: dict[str, Any], code: bytes, name: str) -> Callable[..., Any]:
    """Link the code and return its function. Raises UnresolvedSymbolError if a symbol is missing."""
    import llvmlite.binding as llvm

    target, dynfunc, unpickle, _ = runtime()
    # Each kernel has its own loader: two processes can compile kernels with inner functions of one name, and
    # one loader would use the first of them for both. The process's own symbols are found once there is a
    # loader.
    loader = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target.create_target_machine(jit=True))
    if missing := [needed for needed in head["needs"] if llvm.address_of_symbol(needed) is None]:
        UNRESOLVED.update(missing)
        raise UnresolvedSymbolError
    loader.add_object_file(llvm.ObjectFileRef.from_data(code))
    loader.finalize_object()
    environments = {}
    for environment, constants in head["constants"].items():
        environments[environment] = new = dynfunc.Environment({})
        new.consts[:] = [np.dtype(text) for text in constants]
        place = loader.get_global_value_address(environment)
        if place:
            ctypes.c_void_p.from_address(place).value = id(new)
    address = loader.get_function_address(head["function"])
    own = environments[head["environment"]]
    function: Callable[..., Any] = dynfunc.make_function(
        sys.modules[__name__], name, "machine code", address, own, (loader, unpickle, environments)
    )
    return function


class Runtime(NamedTuple):
    """What runs machine code."""

    target: Any
    """LLVM's target."""
    dynfunc: Any
    """The library of numba that makes Python functions of machine code."""
    unpickle: object
    """The function that machine code calls to unpickle; it must stay alive."""
    linked: dict[object, Callable[..., Any]]
    """The functions that are linked already, by name and check sum."""


@functools.cache
def runtime() -> Runtime:
    """LLVM, prepared with all symbols that machine code calls."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    dynfunc, helpers = _load_library("numba._dynfunc"), _load_library("numba._helperlib")
    runtime = _load_library("numba.core.runtime._nrt_python")
    unpickle = _unpickle_function()
    for name, address in symbols(dynfunc, helpers, runtime):
        llvm.add_symbol(name, address)
    llvm.add_symbol("numba_unpickle", ctypes.cast(unpickle, ctypes.c_void_p).value)
    return Runtime(llvm.Target.from_default_triple(), dynfunc, unpickle, {})


def symbols(dynfunc: Any, helpers: Any, runtime: Any) -> Iterator[tuple[str, int]]:
    """The names and addresses that machine code may use, as numba itself gives them to LLVM."""
    yield "_Py_NoneStruct", id(None)
    for library in (helpers, dynfunc):
        for name, address in library.c_helpers.items():
            yield f"numba_{name}", address
    for name, address in runtime.c_helpers.items():
        yield name if name.startswith("_") else f"NRT_{name}", address
    for kind in vars(builtins).values():
        if isinstance(kind, type) and issubclass(kind, BaseException):
            yield f"PyExc_{kind.__name__}", id(kind)


def _unpickle_function() -> Any:
    """C function (data, length, name of the data) → object, for the types of what a kernel returns.

    numba's own function needs the import of numba. It is used only for what is not a type, such as the errors
    that a kernel raises.
    """

    # Cached by address, since a kernel calls it whenever it returns an array. Machine code does not move.
    @functools.cache
    def unpickled(address: int, length: int, named: int) -> Any:
        data = ctypes.string_at(address, length)
        if found := PICKLED_TYPE.fullmatch(data):
            module, kind = (part.decode() for part in found.groups())
            return getattr(importlib.import_module(module), kind)
        name = ctypes.string_at(named, 20)
        return importlib.import_module("numba.core.serialize")._numba_unpickle(0, data, name)

    return ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)(unpickled)


def _numba_path(*below: str) -> Path:
    """A path in numba's folder, found without importing numba."""
    found = importlib.util.find_spec("numba")
    if found is None or found.origin is None:
        raise ImportError("numba")
    return Path(found.origin).parent.joinpath(*below)


def _load_library(name: str) -> ModuleType:
    """A C library of numba, loaded without the package numba. A later import of numba shares it."""
    if name not in sys.modules:
        folder = _numba_path(*name.split(".")[1:-1])
        found = importlib.machinery.PathFinder.find_spec(name, [str(folder)])
        if found is None or found.loader is None:
            raise ImportError(name)
        module = sys.modules[name] = importlib.util.module_from_spec(found)
        found.loader.exec_module(module)
    return sys.modules[name]
