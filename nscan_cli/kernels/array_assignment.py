"""Assignment of arrays by loops.

For `a[:] = b`, numba checks the shapes, and compiles the code of its error message into every kernel.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from nscan_cli.kernels.decorators import leaf_kernel


@leaf_kernel
def assign(target: NDArray[Any], source: NDArray[Any]) -> None:
    """Copy `source` (n,) into `target` (n,)."""
    for k in range(target.shape[0]):
        target[k] = source[k]


@leaf_kernel
def assign_rows(target: NDArray[Any], source: NDArray[Any]) -> None:
    """Copy `source` (n, m) into `target` (n, m)."""
    for row in range(target.shape[0]):
        for k in range(target.shape[1]):
            target[row, k] = source[row, k]
