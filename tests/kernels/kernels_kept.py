"""Some kernels, and processes that compile them, or load what another one has kept."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.data import REPOSITORY

KERNELS = """
from typing import NamedTuple
import numpy as np
from nscan_cli.kernels.decorators import numba_inline_kernel, kernel, leaf_kernel, reduction_kernel

class Pair(NamedTuple):
    numbers: np.ndarray
    factor: float

@kernel
def add(a, b):
    return a + b

@numba_inline_kernel
def row(table, i):
    return table[i]

@reduction_kernel
def total(numbers):
    s = 0.0
    for number in numbers:
        s += number
    return s

@leaf_kernel
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
from nscan_cli.kernels.cache_folder import cache_folder
from nscan_cli.kernels.machine_code import is_uncompiled
from some_kernels import Pair, add, refuse, scaled

first = is_uncompiled("add")
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
print(json.dumps([str(cache_folder()), first, is_uncompiled("add"), results, imported]))
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


def environment(folder: Path) -> dict[str, str]:
    """That of a process which has the folder's modules, and keeps what it compiles there."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "XDG_"))}
    places = {
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "PYTHONPATH": os.pathsep.join([str(folder), str(REPOSITORY)]),
    }
    return kept | places


def write_module(folder: Path, text: str) -> None:
    """Write some_kernels.py unless it is there: older numba compiles again if a file is newer."""
    file = folder / "some_kernels.py"
    if not file.exists() or file.read_text() != text:
        file.write_text(text)


def process(folder: Path, code: str, **settings: str) -> bytes:
    """What a new process prints that has this environment."""
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(folder) | settings, capture_output=True, check=True
    )
    assert not done.stderr
    return done.stdout


def report(folder: Path, begin: str = "", **settings: str) -> list[Any]:
    """What a new process says of kernels that it compiles or loads, with all that is kept in the folder."""
    write_module(folder, KERNELS)
    answer: list[Any] = json.loads(process(folder, begin + REPORT, **settings))
    return answer


def files(folder: Path, suffix: str) -> list[Path]:
    return sorted((folder / "cache").rglob(f"*.{suffix}"))
