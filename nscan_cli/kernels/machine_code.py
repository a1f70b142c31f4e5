"""Machine code that numba has made, kept in files that run without numba.

To import numba, and to let it load what it has kept, takes longer and more memory than to match the scans
of a short log. But all that its machine code needs is LLVM's loader (llvmlite) and three small libraries
with the functions that it calls: the one that turns arrays into Python's objects, for instance.
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
from typing import Any

import numpy as np

from nscan_cli.files.outputs import write_first
from nscan_cli.kernels.cache_folder import cache_folder

HARMLESS = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_DISABLE_INTEL_SVML"}
"""Settings of numba that change nothing in a kernel's machine code."""
SETTINGS = ".numba_config.yaml"
"""Where numba looks for settings in the current folder."""
SUFFIX = ".code"
LEFT = ".left"
"""Suffix of an empty file that says: this kernel's code cannot be kept here, and is left to numba."""
PICKLED_TYPE = re.compile(rb"\x80\x04\x95.{8}\x8c.([\w.]+)\x94\x8c.(\w+)\x94\x93\x94\.", re.DOTALL)
"""A class or type as pickle's protocol 4 writes it: by the name of its module and its own."""
MISSING: set[str] = set()
"""What kept machine code has called in vain in this process: with numba imported, it may be there."""


def machine() -> str | None:
    """What machine code depends on beside its sources: the versions of what makes it, and the processor.

    None where kernels are left to numba: it is told something special, or is not as it is known here.
    """
    made_by = _made_by()
    return None if made_by is None else _digest((made_by, vector_library()))


@functools.cache
def _made_by() -> object:
    if any(name.startswith("NUMBA_") and name not in HARMLESS for name in os.environ):
        return None
    if os.path.exists(SETTINGS):
        return None
    try:
        import llvmlite
        import llvmlite.binding as llvm

        versions = sys.version, np.__version__, llvmlite.__version__, _numba("_version.py").read_text()
        processor = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    except Exception:
        return None
    return versions, processor


def vector_library() -> str:
    """The library whose functions LLVM puts into loops; "" where there is none.

    numba takes it where somebody else has imported it, in processes of which others need not have it.
    """
    config = getattr(sys.modules.get("numba"), "config", None)
    return "svml" if getattr(config, "USING_SVML", False) else ""


def kept_in(name: str, kinds: object) -> Path | None:
    """The file for the machine code of a kernel for arguments of these kinds; None where it is not kept."""
    folder, made_by = cache_folder(), machine()
    if folder is None or made_by is None:
        return None
    file = folder / f"{name}-{made_by}-{_digest(kinds)}{SUFFIX}"
    return None if file.with_suffix(LEFT).exists() else file


def first_compile(name: str) -> bool:
    """Whether the kernel `name` is still to be compiled: it is not in the cache folder, or there is none."""
    folder, file = cache_folder(), kept_in(name, None)
    kept = f"*.{name}-*.nbi" if file is None else f"*.{name}-{machine()}-*"
    return folder is None or next(folder.rglob(kept), None) is None


def _digest(value: object) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()[:16]


def keep(file: Path, name: str, compiled: Any) -> Callable[..., Any] | None:
    """Write what numba has compiled (a CompileResult) to the file, where there is room and it is not there.

    Returns the function that is kept now, None where there is none. Compiled again, a kernel need not become
    the same machine code, nor round alike: that follows from the order in which kernels are compiled, too.
    So what is kept first is what all processes run.

    The first line says as JSON what the code is called and needs, its check sum is the second, then comes
    the code.
    """
    try:
        head, code = _parts(compiled)
        if MISSING.intersection(head["needs"]):
            raise UnlinkedError
        write_first(file, b"%s\n%d\n%s" % (json.dumps(head).encode(), zlib.crc32(code), code))
        return _loaded(file, name)
    except (OSError, MemoryError):
        return None
    except Exception:
        # Another numba can raise anything, and call what is not there without it. It keeps its code itself,
        # from the next process on.
        with contextlib.suppress(OSError):
            file.unlink(missing_ok=True)
            file.with_suffix(LEFT).touch()
        return None


def _parts(compiled: Any) -> tuple[dict[str, Any], bytes]:
    """What is to be known of the machine code, and the code."""
    import llvmlite.binding as llvm

    (_name, _kind, (code, bitcode)), description, *_rest, environments = compiled._reduce()
    module = llvm.parse_bitcode(bitcode)
    declared = [each.name for each in (*module.functions, *module.global_variables) if each.is_declaration]
    return {
        "function": description.llvm_cpython_wrapper_name,
        "needs": sorted(name for name in declared if not name.startswith("llvm.")),
        "environment": description.env_name,
        "constants": {each.env_name: [_text(value) for value in each.consts] for each in environments}
        | {description.env_name: [_text(value) for value in compiled.environment.consts]},
    }, code


def _text(constant: Any) -> str:
    """Of a constant that the code uses as a Python object; only types of arrays are known."""
    if not isinstance(constant, np.dtype):
        raise TypeError(constant)
    return constant.str


def load(file: Path, name: str) -> Callable[..., Any] | None:
    """The function that was kept in the file; None where there is none, or none that can run here.

    A file that is damaged, or calls what is not there, is removed.
    """
    try:
        return _loaded(file, name)
    except (FileNotFoundError, MemoryError):
        return None
    except Exception:
        # What is damaged can raise anything; numba compiles it anew.
        with contextlib.suppress(OSError):
            file.unlink()
        return None


def _loaded(file: Path, name: str) -> Callable[..., Any]:
    head, check, code = file.read_bytes().split(b"\n", 2)
    if int(check) != zlib.crc32(code):
        raise ValueError("damaged")
    return _once_linked(json.loads(head), check, code, name)


class UnlinkedError(Exception):
    """Machine code that calls what is not there."""


def _once_linked(head: dict[str, Any], check: bytes, code: bytes, name: str) -> Callable[..., Any]:
    """The function of the code, which is loaded once: loaded again, one would have what the other needs."""
    linked, known_by = engine()[-1], (head["function"], check)
    if known_by not in linked:
        linked[known_by] = _linked(head, code, name)
    return linked[known_by]


def _linked(head: dict[str, Any], code: bytes, name: str) -> Callable[..., Any]:
    """The function of loaded code. Raises UnlinkedError where something that it calls is missing."""
    import llvmlite.binding as llvm

    target, dynfunc, alive, _ = engine()
    # One loader for each: functions inside of two kernels, compiled by two processes, can have the same name,
    # and one loader for both would run the first of them in the other kernel, too. The process's own symbols
    # are found once there is a loader.
    loader = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target.create_target_machine(jit=True))
    if missing := [needed for needed in head["needs"] if llvm.address_of_symbol(needed) is None]:
        MISSING.update(missing)
        raise UnlinkedError
    loader.add_object_file(llvm.ObjectFileRef.from_data(code))
    loader.finalize_object()
    environments = {}
    for environment, constants in head["constants"].items():
        environments[environment] = made = dynfunc.Environment({})
        made.consts[:] = [np.dtype(text) for text in constants]
        place = loader.get_global_value_address(environment)
        if place:
            ctypes.c_void_p.from_address(place).value = id(made)
    address = loader.get_function_address(head["function"])
    own = environments[head["environment"]]
    function: Callable[..., Any] = dynfunc.make_function(
        sys.modules[__name__], name, "machine code", address, own, (loader, alive, environments)
    )
    return function


@functools.cache
def engine() -> tuple[Any, Any, object, dict[object, Callable[..., Any]]]:
    """LLVM's target, which knows all that machine code calls; numba's maker of functions; those made."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    dynfunc, helpers = _library("numba._dynfunc"), _library("numba._helperlib")
    runtime = _library("numba.core.runtime._nrt_python")
    unpickle = _unpickle()
    for name, address in _symbols(dynfunc, helpers, runtime):
        llvm.add_symbol(name, address)
    llvm.add_symbol("numba_unpickle", ctypes.cast(unpickle, ctypes.c_void_p).value)
    return llvm.Target.from_default_triple(), dynfunc, unpickle, {}


def _symbols(dynfunc: Any, helpers: Any, runtime: Any) -> Iterator[tuple[str, int]]:
    """The names that machine code may call, and where they are; as numba itself gives them to LLVM."""
    yield "_Py_NoneStruct", id(None)
    for library in (helpers, dynfunc):
        for name, address in library.c_helpers.items():
            yield f"numba_{name}", address
    for name, address in runtime.c_helpers.items():
        yield name if name.startswith("_") else f"NRT_{name}", address
    for kind in vars(builtins).values():
        if isinstance(kind, type) and issubclass(kind, BaseException):
            yield f"PyExc_{kind.__name__}", id(kind)


def _unpickle() -> Any:
    """C function (data, length, name of the data) → object, for the types of what a kernel returns.

    numba's own does the same, and imports numba. That is left for what is no type: the errors that a
    kernel raises.
    """

    # By its place in the machine code, which stays where it is: a kernel asks whenever it returns an array.
    @functools.cache
    def unpickled(place: int, length: int, named: int) -> Any:
        data = ctypes.string_at(place, length)
        if found := PICKLED_TYPE.fullmatch(data):
            module, kind = (part.decode() for part in found.groups())
            return getattr(importlib.import_module(module), kind)
        name = ctypes.string_at(named, 20)
        return importlib.import_module("numba.core.serialize")._numba_unpickle(0, data, name)

    return ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)(unpickled)


def _numba(*below: str) -> Path:
    """A path in numba's folder, which is found without an import."""
    found = importlib.util.find_spec("numba")
    if found is None or found.origin is None:
        raise ImportError("numba")
    return Path(found.origin).parent.joinpath(*below)


def _library(name: str) -> ModuleType:
    """A library of numba's, without its package; with the package it is shared."""
    if name not in sys.modules:
        folder = _numba(*name.split(".")[1:-1])
        found = importlib.machinery.PathFinder.find_spec(name, [str(folder)])
        if found is None or found.loader is None:
            raise ImportError(name)
        module = sys.modules[name] = importlib.util.module_from_spec(found)
        found.loader.exec_module(module)
    return sys.modules[name]
