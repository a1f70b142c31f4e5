"""The length by which all ranges are too long or too short, by walls that stand square to each other.

square_walls.py says why a length turns walls. Unlike the bend of single walls (bent_walls.py), these turns
are seen on short walls and at any distance, and round things do not look like them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.robot_parts import evenly
from nscan_cli.logs.square_walls import (
    SquareWallOptions,
    WallPairs,
    count_square,
    normal_equations,
    settled,
    wall_pairs,
)
from nscan_cli.logs.wall_angles import SampledScans
from nscan_cli.poses import Array


@dataclass(frozen=True)
class SquareLengthOptions:
    """When walls that are square tell the length."""

    walls: SquareWallOptions = field(default_factory=SquareWallOptions)
    """Which walls are compared."""
    scans: tuple[int, ...] = (100, 400)
    """Numbers of scans that are looked at, evenly spread: more of them where fewer show few pairs or do not
    agree with the log. More take longer."""
    enough_pairs: int = 1000
    """With fewer pairs than this more scans are looked at. A larger value takes longer."""
    sound: float = 0.035
    """The ranges are right without looking at more scans if the length is smaller, m. A larger value takes
    less time."""
    longest: float = 0.4
    """Longest length that is tried, m."""
    step: float = 0.04
    """Interval between the lengths that are tried first, m. A smaller value takes longer."""
    min_pairs: int = 250
    """Least number of pairs that tell. A larger value leaves more logs to single walls."""
    parts: int = 4
    """All but one of so many parts of the log must tell about the same. With more parts fewer logs are
    told."""
    part_tolerance: float = 0.03
    """A part tells the same if its length is this near to that of the log, m. A larger value tells more
    logs."""
    part_share: float = 0.3
    """Or if it differs by this share of that length. A larger value tells more logs."""
    max_sigma: float = 0.015
    """Largest standard deviation of the length, m: far walls hardly tell it. A larger value tells more
    logs."""


class SquareLength(NamedTuple):
    """With what length most pairs of walls are square."""

    length: float
    """By how much ranges are too long, m."""
    sigma: float
    """Its standard deviation, m."""
    gain: float
    """How many more pairs are square with it than without, as a factor."""
    pairs: int
    """The number of pairs."""
    is_steady: bool = False
    """Whether it is precise, and parts of the log tell it."""


def length_by_square_walls(
    ranges: NDArray[np.float32],
    steps: Array,
    is_all_around: bool,
    options: SquareLengthOptions = SquareLengthOptions(),
) -> SquareLength | None:
    """The length that walls tell; None for few pairs of them.

    Only finite `ranges` (S, B) are distances, m; `steps` (S,) are the angles from beam to beam, rad. Beams
    that are a whole turn are as far apart as the log says; else their angle is open, too.
    """
    step = abs(float(np.median(steps)))
    if not 0.0 < step < np.inf or (ranges.shape[1] * step > options.walls.max_view and not is_all_around):
        return None
    for count in options.scans:
        some = evenly(len(ranges), count)
        seen = np.where(np.isfinite(ranges[some]), ranges[some], np.nan).astype(np.float64)
        pairs = wall_pairs(SampledScans(seen, np.abs(steps[some])), options.walls)
        if len(pairs.excess) < options.min_pairs:
            continue
        found = _told(pairs, is_all_around, options)
        if len(pairs.excess) >= options.enough_pairs and abs(found.length) < options.sound:
            break
    if len(pairs.excess) < options.min_pairs:
        return None
    if abs(found.length) > options.longest:
        # The fit left what was tried: walls are turned by something else.
        return None
    tolerance = max(options.part_tolerance, options.part_share * abs(found.length))
    agreeing = 0
    for rows in np.array_split(np.arange(len(pairs.excess)), options.parts):
        part = _told(pairs.some(rows), is_all_around, options).length
        agreeing += abs(part - found.length) <= tolerance
    is_steady = found.sigma <= options.max_sigma and agreeing >= options.parts - 1
    return found._replace(is_steady=is_steady)


def _told(pairs: WallPairs, is_all_around: bool, options: SquareLengthOptions) -> SquareLength:
    """The length with which most pairs are square."""
    tried = math.ceil(options.longest / options.step)
    lengths = options.step * np.arange(-tried, tried + 1)
    some = pairs.some(evenly(len(pairs.excess), options.walls.first_pairs))
    start = float(lengths[np.argmax([count_square(some, 0.0, length) for length in lengths])])
    is_open = not is_all_around
    share, length = settled(pairs, 0.0, start, options.walls, (is_open, True))
    normal, _right = normal_equations(pairs, share, length, (is_open, True))
    without, _none = settled(pairs, 0.0, 0.0, options.walls, (is_open, False))
    gain = count_square(pairs, share, length) / max(count_square(pairs, without, 0.0), 1e-9)
    sigma = math.sqrt(np.linalg.inv(normal)[1, 1])
    return SquareLength(length, sigma, gain, len(pairs.excess))
