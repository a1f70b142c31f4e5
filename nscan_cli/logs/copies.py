"""Records and scans that a log has twice: of files that were joined, or of one written twice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import counted
from nscan_cli.poses import Mask

Record = TypeVar("Record")
BEAM_STRIDE = 16
"""Every beam in this many is compared first; these tell nearly all scans apart."""
KEY = 40
"""Bytes at an end of a record that tell nearly all apart: they have its time. Shorter records have none."""


def without_copies(records: Sequence[Record], content: Callable[[Record], bytes]) -> tuple[list[Record], str]:
    """The records whose content no earlier one has; and what to say, empty if these are all.

    Records hold their time, so that two alike are one. In a log without times some beside each other may be
    of a robot that stands. There each comes as often as the robot stood long, in a log written twice or more
    times over all come equally often.
    """
    texts = [content(record) for record in records]
    if len({(text[:KEY], text[-KEY:]) for text in texts}) == len(texts):
        return list(records), ""
    seen, kept = set[bytes](), list[Record]()
    repeats = np.array([row > 0 and text == texts[row - 1] for row, text in enumerate(texts)], np.bool_)
    may_stand = bool(repeats[1:].all()) or not come_equally_often(repeats, 1.0)
    for row, (record, text) in enumerate(zip(records, texts, strict=True)):
        if text not in seen or (may_stand and text == texts[row - 1]) or len(text) < KEY:
            kept.append(record)
        seen.add(text)
    copies = counted(len(records) - len(kept), "record")
    return kept, "" if len(kept) == len(records) else f"{copies} that repeat earlier ones are left out"


def come_equally_often(repeats: Mask, least_share: float) -> bool:
    """Whether records come more than once, at least so large a share of them equally often.

    `repeats` (S,) are the records that repeat the one before.
    """
    times = np.diff(np.append(np.flatnonzero(~repeats), len(repeats)))
    usual = int(np.median(times)) if len(times) else 1
    return usual > 1 and float(np.mean(times == usual)) >= least_share


def repeat_reading(ranges: NDArray[np.float32]) -> Mask:
    """(S,) which scans have the readings (S, B) of the one before, all of them."""
    repeats = np.append(False, _are_equal(ranges[1:, ::BEAM_STRIDE], ranges[:-1, ::BEAM_STRIDE]))
    repeats = repeats[: len(ranges)]
    rows = np.flatnonzero(repeats)
    repeats[rows] = _are_equal(ranges[rows], ranges[rows - 1])
    return repeats


def _are_equal(one: NDArray[np.float32], other: NDArray[np.float32]) -> Mask:
    same: Mask = ((one == other) | (np.isnan(one) & np.isnan(other))).all(axis=1)
    return same
