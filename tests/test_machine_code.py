"""Machine code that is kept, that runs without numba, and that is made anew where it cannot."""

from __future__ import annotations

import itertools
import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli import machine_code
from nscan_cli.cache_folder import PACKAGE
from nscan_cli.compiled import Kernel, kernel

KERNELS = """
from typing import NamedTuple
import numpy as np
from nscan_cli.compiled import inlined_kernel, kernel, lean_kernel, summing_kernel

class Pair(NamedTuple):
    numbers: np.ndarray
    factor: float

@kernel
def add(a, b):
    return a + b

@inlined_kernel
def row(table, i):
    return table[i]

@summing_kernel
def total(numbers):
    s = 0.0
    for number in numbers:
        s += number
    return s

@lean_kernel
def weigh(table, factor, i):
    return total(row(table, i)) * factor

@kernel
def scaled(pair):
    weights = np.empty(len(pair.numbers), dtype=np.float32)
    for i in range(len(weights)):
        weights[i] = weigh(pair.numbers, pair.factor, i)
    return Pair(weights, -pair.factor), (len(weights), True)

@kernel
def refuse(a):
    if a > 1:
        raise ValueError("too much")
    return a
"""
REPORT = """
import json, sys
import numpy as np
from nscan_cli.cache_folder import cache_folder
from nscan_cli.machine_code import first_compile
from some_kernels import Pair, add, refuse, scaled

first = first_compile("add")
numbers = np.arange(6.0).reshape(2, 3)
results = [add(1, 2), add(1.0, 0.5), add(np.float64(1), 2.0)]
for layout in (numbers, np.asfortranarray(numbers), numbers[:, ::2], numbers[::-1]):
    pair, counts = scaled(Pair(layout, 2.0))
    kind = type(pair).__name__, pair.numbers.dtype.name
    results.append([*kind, pair.numbers.tolist(), pair.factor, *counts])
imported = "numba" in sys.modules
try:
    refuse(2)
except ValueError as error:
    results.append(str(error))
print(json.dumps([str(cache_folder()), first, first_compile("add"), results, imported]))
"""
RESULTS = [
    3,
    1.5,
    3.0,
    ["Pair", "float32", [6.0, 24.0], -2.0, 2, True],
    ["Pair", "float32", [6.0, 24.0], -2.0, 2, True],
    ["Pair", "float32", [4.0, 16.0], -2.0, 2, True],
    ["Pair", "float32", [24.0, 6.0], -2.0, 2, True],
    "too much",
]


def process(folder: Path, code: str, **settings: str) -> bytes:
    """What a new process prints, which has the folder's modules, and keeps what it compiles there."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "XDG_"))}
    places = {
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "PYTHONPATH": os.pathsep.join([str(folder), str(PACKAGE.parent)]),
    }
    done = subprocess.run(
        [sys.executable, "-c", code], env={**kept, **places, **settings}, capture_output=True, check=True
    )
    assert not done.stderr
    return done.stdout


def report(folder: Path, begin: str = "", **settings: str) -> list[Any]:
    """What a new process says of kernels that it compiles or loads, with all that is kept in the folder."""
    (folder / "some_kernels.py").write_text(KERNELS)
    answer: list[Any] = json.loads(process(folder, begin + REPORT, **settings))
    return answer


def files(folder: Path, suffix: str) -> list[Path]:
    return sorted((folder / "cache").rglob(f"*.{suffix}"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    """A folder where all is kept; tests leave it so."""
    folder: Path = tmp_path_factory.mktemp("whole")
    place, first, after, results, numba = report(folder)
    assert str(place).startswith(str(folder / "cache"))
    assert (first, after, results, numba) == (True, False, RESULTS, True)
    return folder


def test_kept_machine_code_runs_without_numba(whole):
    # add for whole numbers and for others, scaled for three layouts, refuse.
    assert len(files(whole, "code")) == 6
    before = {path: path.stat().st_mtime_ns for path in (whole / "cache").rglob("*")}
    assert report(whole)[1:] == [False, False, RESULTS, False]
    assert {path: path.stat().st_mtime_ns for path in (whole / "cache").rglob("*")} == before


def test_kept_machine_code_and_numba_share_a_process(whole):
    """In either order, and when some of the code is kept and some is not."""
    own = "import numba; own = numba.njit(lambda a: (a + 1, a)); own(__import__('numpy').zeros(3));\n"
    assert report(whole, own)[3:] == [RESULTS, True]
    aside = "import contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):\n    "
    assert report(whole, f"{aside}exec({REPORT + own!r})\n")[3:] == [RESULTS, True]
    for path in files(whole, "code")[::2]:
        path.unlink()
    assert report(whole)[3:] == [RESULTS, True]


def test_a_full_disk_under_the_cache_stops_nothing(tmp_path):
    """No file can grow beyond 100 bytes."""
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))\n"
    assert report(tmp_path, limit)[3] == RESULTS
    left = [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]
    assert not [path.name for path in left if path.stat().st_size > 100 or ".tmp." in path.name]
    assert not files(tmp_path, "code")


def half(data: bytes) -> bytes:
    return data[: len(data) // 2]


def changed(data: bytes) -> bytes:
    """Another byte in the machine code, as a disk that fails would have it."""
    return data[:-100] + bytes([data[-100] ^ 1]) + data[-99:]


def missing(data: bytes) -> bytes:
    """Code that calls what is not there, as that of another numba may."""
    head, rest = data.split(b"\n", 1)
    said = json.loads(head)
    said["needs"].append("NRT_of_another_numba")
    return json.dumps(said).encode() + b"\n" + rest


def test_a_damaged_cache_is_made_anew(whole):
    damages: list[Callable[[bytes], bytes]] = [half, changed, missing, lambda data: b""]
    kept = files(whole, "code")
    assert len(kept) > len(damages)
    for path, damage in zip(kept, itertools.cycle(damages), strict=False):
        path.write_bytes(damage(path.read_bytes()))
    nbi, *_others = files(whole, "nbi")
    nbc = files(whole, "nbc")[-1]
    for path in (nbi, nbc):
        path.write_bytes(half(path.read_bytes()))
    assert report(whole)[3:] == [RESULTS, True]
    assert report(whole)[3:] == [RESULTS, False]


@pytest.mark.parametrize("setting", ["NUMBA_DISABLE_JIT", "NUMBA_BOUNDSCHECK"])
def test_what_numba_is_told_holds(whole, setting):
    """Kept code is neither used nor made: it would not do what the setting says."""
    before = files(whole, "code")
    assert report(whole, **{setting: "1"})[3:] == [RESULTS, True]
    assert files(whole, "code") == before


def test_code_of_an_unknown_numba_is_left_to_its_own_cache(tmp_path):
    """It has renamed what is asked here: compiled in the first process, kept by numba in the second."""
    swapped = "import nscan_cli.machine_code as m; m._parts = lambda compiled: compiled._renamed()\n"
    assert report(tmp_path, swapped)[1:] == [True, False, RESULTS, True]
    assert report(tmp_path, swapped)[3:] == [RESULTS, True]
    kept = files(tmp_path, "nbc")
    assert report(tmp_path, swapped)[1:] == [False, False, RESULTS, True]
    assert files(tmp_path, "nbc") == kept
    assert not files(tmp_path, "code")


HIDDEN = """
import nscan_cli.machine_code as m
whole = m._symbols
m._symbols = lambda *libraries: (each for each in whole(*libraries) if each[0] != "NRT_adapt_ndarray_from_python")
"""
NOWHERE = """
import llvmlite.binding as llvm
find = llvm.address_of_symbol
llvm.address_of_symbol = lambda name: None if name == "NRT_adapt_ndarray_from_python" else find(name)
"""


@pytest.mark.parametrize("hide", [HIDDEN, NOWHERE], ids=["without numba", "at all"])
def test_code_that_calls_what_is_missing_is_left_to_numba(tmp_path, hide):
    """As that for a vector library does, which numba finds; it is not compiled anew in every process."""
    assert report(tmp_path)[3:] == [RESULTS, True]
    whole = set(files(tmp_path, "code"))
    # Found to be missing, compiled, and left; compiled and kept by numba; there from then on.
    for _ in range(2):
        assert report(tmp_path, hide)[3:] == [RESULTS, True]
    lefts, kept = files(tmp_path, "left"), {path: path.stat().st_mtime_ns for path in files(tmp_path, "nb?")}
    assert lefts
    assert {path.with_suffix(".code") for path in lefts} | set(files(tmp_path, "code")) == whole
    assert report(tmp_path, hide)[1:] == [False, False, RESULTS, True]
    assert {path: path.stat().st_mtime_ns for path in files(tmp_path, "nb?")} == kept
    assert files(tmp_path, "left") == lefts


SVML = """
import numba
numba.config.USING_SVML = True
"""


def test_a_vector_library_has_machine_code_of_its_own(whole):
    """It is there where somebody else has imported numba so: other processes would not find it."""
    before = {path: path.stat().st_mtime_ns for path in (whole / "cache").rglob("*.*") if path.is_file()}
    assert report(whole, SVML)[1:] == [True, False, RESULTS, True]
    assert len(files(whole, "code")) == 12
    assert report(whole)[1:] == [False, False, RESULTS, False]
    assert {path: path.stat().st_mtime_ns for path in before} == before
    for path in (whole / "cache").rglob("*.*"):
        if path.is_file() and path not in before:
            path.unlink()


def test_numba_takes_no_vector_library_here(tmp_path):
    """Whatever machine it is: sines in a loop would round otherwise."""
    (tmp_path / "some_kernels.py").write_text(KERNELS)
    (tmp_path / "numba").mkdir()
    told = "import os; print(os.environ['NUMBA_DISABLE_INTEL_SVML']); raise SystemExit"
    (tmp_path / "numba" / "__init__.py").write_text(told)
    assert process(tmp_path, "from some_kernels import add; add(1, 2)") == b"1\n"


WAVES = """
import math
from nscan_cli.compiled import kernel, lean_kernel

@lean_kernel
def waves(x):
    total = 0.0
    for i in range(9):
        total += {}
    return total
"""
CALLER = """
@kernel
def {}(x):
    return waves(x), waves(-x), waves(x + 1.0), waves(x - 1.0)
"""


def test_functions_of_the_same_name_in_two_kernels_stay_apart(tmp_path):
    """numba tells functions apart by counting them, and counts anew in each process."""
    kinds = {"odd": "math.sin", "even": "math.cos"}
    modules = {
        name: WAVES.format(" + ".join(f"{wave}({i}.0 * x + i)" for i in range(1, 30))) + CALLER.format(name)
        for name, wave in kinds.items()
    }
    for name, module in modules.items():
        # Each is compiled while the other is not there.
        (tmp_path / "kinds_of_waves.py").write_text(module)
        process(tmp_path, f"from kinds_of_waves import {name}; {name}(0.5)")
    assert len(files(tmp_path, "code")) == 2
    # Both, from what is kept: neither is compiled again.
    (tmp_path / "kinds_of_waves.py").write_text(modules["odd"] + CALLER.format("even"))
    both = "import json, sys; from kinds_of_waves import *; found = [odd(0.5), even(0.5)]\n"
    said = "print(json.dumps([*found, 'numba' in sys.modules]))"
    *found, imported = json.loads(process(tmp_path, both + said))
    assert not imported
    for wave, values in zip((math.sin, math.cos), found, strict=True):
        wanted = [
            sum(wave(j * x + i) for i in range(9) for j in range(1, 30)) for x in (0.5, -0.5, 1.5, -0.5)
        ]
        np.testing.assert_allclose(values, wanted, rtol=1e-9, atol=1e-9)


def test_all_processes_run_what_was_kept_first(tmp_path, monkeypatch):
    """Two compile at the same time, and what they make need not round alike: here it differs by one."""
    monkeypatch.setattr(machine_code, "cache_folder", lambda: tmp_path)

    def made(more: float) -> Any:
        @kernel
        def shifted(value: float) -> float:
            return value + more

        return shifted

    assert made(1.0)(0.0) == 1.0
    (kept,) = tmp_path.glob(f"*{machine_code.SUFFIX}")
    first = kept.read_bytes()
    # Looked for the first time, it is not there yet.
    loads: list[Callable[..., Any]] = [machine_code.load] * 3 + [lambda *_: None]
    monkeypatch.setattr(machine_code, "load", lambda *call: loads.pop()(*call))
    assert made(2.0)(0.0) == 1.0
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [first]
    kept.unlink()
    assert made(2.0)(0.0) == 2.0


def test_machine_code_is_loaded_once(tmp_path, monkeypatch):
    """Loaded again, it would stand beside itself with the same names, and each use what the other has."""
    monkeypatch.setattr(machine_code, "cache_folder", lambda: tmp_path)

    @kernel
    def both(values: Any) -> Any:
        return values, values + 1.0

    numbers = np.arange(3.0)
    both(numbers)
    assert isinstance(both, Kernel)
    (kept,), (first,) = tmp_path.glob(f"*{machine_code.SUFFIX}"), both._versions.values()
    assert machine_code.load(kept, "both") is first
    both._versions.clear()
    both._by_looks.clear()
    np.testing.assert_array_equal(both(numbers)[1], [1.0, 2.0, 3.0])
    assert list(both._versions.values()) == [first]
