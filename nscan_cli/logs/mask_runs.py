"""The runs of a mask: where rows in a row have something in common."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Mask


def mask_runs(mask: Mask) -> list[tuple[int, int]]:
    """The first row, and the row after the last, of each run of marked rows in a mask (n,), in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(first, end) for first, end in edges.reshape(-1, 2).tolist()]
