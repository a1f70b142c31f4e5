"""The runs of a mask: where rows in a row have something in common, and how a message names them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from nscan_cli.files.text import shortened_list
from nscan_cli.poses import Mask


def mask_runs(mask: Mask) -> list[tuple[int, int]]:
    """The first row, and the row after the last, of each run of marked rows in a mask (n,), in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(first, end) for first, end in edges.reshape(-1, 2).tolist()]


def stretch_names(stretches: Iterable[tuple[int, int]]) -> str:
    """Names of stretches, given by the numbers of their first and last scans."""
    names = [f"{first} to {last}" for first, last in stretches]
    return shortened_list(names, "more stretch")
