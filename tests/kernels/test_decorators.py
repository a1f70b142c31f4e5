"""Kernels: what they take, which calls share their code, and what all of the package keep to."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from nscan_cli.kernels.decorators import Kernel, kernel
from tests.data import CORRIDOR_LOG, PACKAGE, REPOSITORY


def test_kernels_take_arrays_numbers_and_tuples():
    @kernel
    def first(values: Any) -> Any:
        return values[0]

    assert first((1.5, np.ones(2))) == 1.5
    with pytest.raises(TypeError, match="kernels take arrays, numbers and tuples of them, not list"):
        first([1.5])


def test_an_array_that_cannot_be_written_has_code_of_its_own():
    @kernel
    def lowest(values: Any) -> Any:
        return values.min()

    values = np.array([2.0, 1.0])
    values.setflags(write=False)
    assert lowest(values) == lowest(values.copy()) == 1.0
    assert isinstance(lowest, Kernel)
    assert len(lowest.specialisations) == 2


def test_arrays_that_only_look_different_have_the_same_code():
    @kernel
    def greatest(values: Any) -> Any:
        return values.max()

    values = np.array([2.0, 1.0])
    assert greatest(values) == greatest(values[:]) == 2.0
    assert isinstance(greatest, Kernel)
    assert len(greatest.by_fingerprint) == 2
    assert len(greatest.specialisations) == 1


COMMANDS = """
import sys
from nscan_cli.cli.main import run
for arguments in (
    ["match", LOG, "--reference", "0", "--scan", "9"],
    ["nscan", LOG, "--scans", "0-20:5"],
    ["slam", LOG, "-q", "-o", GRAPH, "--map", MAP],
    ["slam", "--from", GRAPH, "-q", "-o", GRAPH + "2"],
    ["render", GRAPH, LOG, "-o", MAP],
):
    assert run(arguments) == 0, arguments
print("numba" in sys.modules)
"""


def test_no_command_imports_numba_twice(tmp_path):
    """All that the kernels of the package return and hold can be kept."""
    paths = {"LOG": CORRIDOR_LOG, "GRAPH": tmp_path / "graph.json", "MAP": tmp_path / "map.png"}
    named = "".join(f"{name} = {str(path)!r}\n" for name, path in paths.items())
    clean = {
        name: value for name, value in os.environ.items() if name == "NUMBA_CACHE_DIR" or "NUMBA" not in name
    }
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", named + COMMANDS], env=clean, capture_output=True, check=True, text=True,
            cwd=REPOSITORY,
        )  # fmt: skip
    assert done.stdout.splitlines()[-1] == "False"


def kernels() -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions of the package that are compiled."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef) and any(
                isinstance(each, ast.Name) and each.id.endswith("kernel") for each in node.decorator_list
            ):
                yield f"{path.stem}.{node.name}", node


def test_no_kernel_needs_scipy():
    """numba takes products of matrices from SciPy's BLAS: a kernel with one would have to import it."""
    found = dict(kernels())
    assert len(found) > 50
    for name, function in found.items():
        for node in ast.walk(function):
            assert not isinstance(node, ast.MatMult), name
            assert not (isinstance(node, ast.Attribute) and node.attr in ("dot", "linalg")), name
