"""Rows of a table that repeat the one before: they say nothing of their own time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Mask


def differ_from_last(rows: NDArray[Any]) -> Mask:
    """(n,) which of rows (n, d) differ from the one before; the first one does."""
    differ: Mask = np.ones(len(rows), dtype=np.bool_)
    differ[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return differ
