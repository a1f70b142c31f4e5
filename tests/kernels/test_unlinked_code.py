"""Machine code that cannot be linked in every process."""

from __future__ import annotations

import pytest

from tests.kernels.kernels_kept import KERNELS, RESULTS, files, process, report

HIDDEN = """
import nscan_cli.kernels.machine_code as m
whole = m.symbols
name = "NRT_adapt_ndarray_from_python"
m.symbols = lambda *libraries: (each for each in whole(*libraries) if each[0] != name)
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


def test_a_vector_library_has_machine_code_of_its_own(tmp_path):
    """It is there where somebody else has imported numba so: other processes would not find it."""
    report(tmp_path)
    paths = [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]
    before = {path: path.stat().st_mtime_ns for path in paths}
    assert report(tmp_path, SVML)[1:] == [True, False, RESULTS, True]
    assert len(files(tmp_path, "code")) == 12
    assert report(tmp_path)[1:] == [False, False, RESULTS, False]
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_numba_takes_no_vector_library_here(tmp_path):
    """Whatever machine it is: sines in a loop would round otherwise."""
    (tmp_path / "some_kernels.py").write_text(KERNELS)
    (tmp_path / "numba").mkdir()
    told = "import os; print(os.environ['NUMBA_DISABLE_INTEL_SVML']); raise SystemExit"
    (tmp_path / "numba" / "__init__.py").write_text(told)
    assert process(tmp_path, "from some_kernels import add; add(1, 2)") == b"1\n"


FOREIGN = """
import json
import numba
import numpy as np
from some_kernels import Pair, scaled

scaled(Pair(np.ones((2, 3)), 2.0))

@numba.njit
def own(n):
    return np.empty(n, dtype=np.float32), np.zeros(n).sum()

print(json.dumps(len(own(3)[0])))
"""


def test_functions_of_others_can_call_what_was_compiled_for_a_kernel(tmp_path):
    """numba keeps the functions that make arrays: those of a kernel have no machine code."""
    (tmp_path / "some_kernels.py").write_text(KERNELS)
    assert process(tmp_path, FOREIGN) == b"3\n"
