"""Ranges that all are too long or too short by one length, as walls tell.

Walls that are square to each other tell it most precisely (square_length.py); where there are few of them,
single walls do, which are bent then (bent_walls.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import counted
from nscan_cli.logs.bent_walls import by_bent_walls
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.square_length import length_by_square_walls
from nscan_cli.poses import Array


@dataclass(frozen=True)
class RangeOffsetOptions:
    """When a length is taken from all ranges, or added, or named."""

    min_offset: float = 0.08
    """Least length that is taken from the ranges, m: walls tell -0.05 to 0.05 on real logs, the most by
    lasers that measure too long. A larger value changes fewer logs."""
    likely_offset: float = 0.06
    """From this length on it is named, m. A larger value names it for fewer logs."""
    likely_gain: float = 1.15
    """So many more pairs of walls are square without that length, as a factor: where it is nothing they are
    1.13 at most on real logs, by chance. A larger value names it for fewer logs."""
    min_gain_by_length: float = 2.5
    """And 1 plus so many times the length where it is taken from the ranges, 1/m: the longer it is, the fewer
    walls stay square with it. A larger value changes fewer logs."""
    agreement: float = 0.04
    """Largest difference of what bent walls tell from what walls tell that are square to each other, m. A
    larger value names it for more logs."""


def checked_offset(
    ranges: NDArray[np.float32], steps: Array, reading: ReadingOptions
) -> tuple[float, list[str]]:
    """The length to add to ranges (S, B), m, and what is said of it; 0 if they are right.

    `steps` (S,) are the angles from beam to beam, rad. Only finite ranges are distances.
    """
    if reading.range_offset is not None or reading.as_recorded or not len(ranges):
        return reading.range_offset or 0.0, []
    options = RangeOffsetOptions()
    is_all_around = _sees_all_around(ranges, steps)
    square = length_by_square_walls(ranges, steps, is_all_around)
    if square is not None and square.is_steady and square.gain >= options.likely_gain:
        size = abs(square.length)
        if size >= options.likely_offset:
            is_certain = size >= options.min_offset and square.gain >= 1.0 + options.min_gain_by_length * size
            pairs = counted(square.pairs, "pair")
            said = f"{square.gain:.1f} times as many of {pairs} of walls are square to each other"
            return _as_told(square.length, is_certain, said)
    bent = by_bent_walls(ranges, steps, is_all_around, (options.likely_offset, options.min_offset))
    if bent is None or (square is not None and abs(square.length - bent.offset) > options.agreement):
        return 0.0, []
    is_certain = bent.is_certain and square is None
    return _as_told(
        bent.offset, is_certain, f"{counted(bent.walls, 'wall')} are straight, with it they are bent"
    )


def _as_told(length: float, is_certain: bool, evidence: str) -> tuple[float, list[str]]:
    """What to add to ranges that are too long by a length, m, and what is said of it."""
    offset = round(length, 2)
    what = f"{abs(offset):.2f} m too {'long' if offset > 0.0 else 'short'}"
    if not is_certain:
        return 0.0, [
            f"the ranges are likely {what}: without that {evidence}; try --range-offset {-offset:.2f}; if "
            "the map is worse then, the angle between beams is wrong instead (--angle-increment)"
        ]
    return -offset, [
        f"the ranges are {what}: without that {evidence}; {-offset:+.2f} m is added, as by --range-offset "
        f"{-offset:.2f}; --as-recorded uses the ranges as they are"
    ]


def _sees_all_around(ranges: NDArray[np.float32], steps: Array) -> bool:
    """Whether the beams of scans (S, B), `steps` (S,) rad apart, are a whole turn.

    Then the angle between them is not wrong by a little.
    """
    step = abs(float(np.median(steps)))
    return bool(abs(ranges.shape[1] * step - 2.0 * math.pi) < 1.5 * step)
