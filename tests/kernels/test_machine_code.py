"""Machine code that is kept, that runs without numba, and that is made anew where it cannot."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli.kernels import machine_code
from nscan_cli.kernels.decorators import Kernel, kernel
from tests.kernels.kernels_kept import REPORT, RESULTS, files, process, report


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    """A folder where all is kept; tests leave it so."""
    folder: Path = tmp_path_factory.mktemp("whole")
    place, first, after, results, numba = report(folder)
    assert str(place).startswith(str(folder / "cache"))
    assert (first, after, results, numba) == (True, False, RESULTS, True)
    return folder


def test_kept_machine_code_runs_without_numba(whole):
    # add for whole numbers and for others, scaled for three layouts, refuse; none for what only kernels call.
    assert len(files(whole, "code")) == 6
    assert not files(whole, "nb?")
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
    swapped = (
        "import nscan_cli.kernels.machine_code as m; m.object_code = lambda compiled: compiled._renamed()\n"
    )
    assert report(tmp_path, swapped)[1:] == [True, False, RESULTS, True]
    assert report(tmp_path, swapped)[3:] == [RESULTS, True]
    kept = files(tmp_path, "nbc")
    assert report(tmp_path, swapped)[1:] == [False, False, RESULTS, True]
    assert files(tmp_path, "nbc") == kept
    assert not files(tmp_path, "code")


WAVES = """
import math
from nscan_cli.kernels.decorators import kernel, leaf_kernel

@leaf_kernel
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
    loads: list[Callable[..., Any]] = [machine_code.load] * 4 + [lambda *_: None] * 2
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
    (kept,), (first,) = tmp_path.glob(f"*{machine_code.SUFFIX}"), both.specialisations.values()
    assert machine_code.load(kept, "both") is first
    both.specialisations.clear()
    both.by_fingerprint.clear()
    np.testing.assert_array_equal(both(numbers)[1], [1.0, 2.0, 3.0])
    assert list(both.specialisations.values()) == [first]
