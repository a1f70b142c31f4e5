"""The beams that a log is read without: those that --mask names, or those that see the robot itself."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.dead_beams import dead_beams
from nscan_cli.logs.reading_options import SECTOR_PARTS, ReadingOptions, sector_text
from nscan_cli.logs.robot_parts import ScanTable, Sector, robot_parts
from nscan_cli.poses import Array, Mask

Bearings = tuple[float, ...]
"""A sector from the first counter-clockwise to the last, in the laser's frame, rad; if a range (m) follows,
only what is nearer."""
BEARING_ROUNDING = 1e-5
"""rad; messages have 32 bits, logs and --mask have decimals of degrees."""


def masked_sectors(table: ScanTable, options: ReadingOptions) -> tuple[list[Bearings], list[str]]:
    """The sectors that are not read, and the messages for the user."""
    if options.mask is not None:
        return list(options.mask), []
    if options.as_recorded:
        return [], []
    found, constant = robot_parts(table), dead_beams(table)
    constant = [one for one in constant if not any(_is_within(one, part) for part in found)]
    sectors: list[Bearings] = [(sector.first, sector.last) for sector in (*found, *constant)]
    left_out = f"are left out, as by --mask {mask_text(sectors)}; --as-recorded uses them"
    said = []
    if found:
        said.append(
            f"beams keep their range ({_ranges(found)} m) while the robot turns, so they see the robot "
            f"itself; they {left_out}"
        )
    if constant:
        said.append(
            f"beams say exactly the same ({_ranges(constant)} m) in all scans while the others change, so "
            f"they see the robot itself or are dead; they {left_out}"
        )
    return sectors, said


def _is_within(sector: Sector, other: Sector) -> bool:
    return other.first <= sector.first and sector.last <= other.last


def _ranges(found: Sequence[Sector]) -> str:
    return " and ".join(f"{distance:.2f}" for distance in sorted({round(one.range, 2) for one in found}))


def mask_text(sectors: Sequence[Bearings]) -> str:
    """Sectors (rad, and m) as --mask takes them, in degrees."""
    return ",".join(sector_text(sector, (1, 2)) for sector in sectors)


def mask_beams(
    ranges: NDArray[np.float32], angle_min: Array, angle_increment: Array, sectors: Sequence[Bearings]
) -> int:
    """Write nan for the beams of scans (S, B) in the sectors, in place; returns how many readings that were.

    ranges are in m; angle_min, angle_increment: (S,), rad.
    """
    if not sectors:
        return 0
    is_same = (angle_min == angle_min[0]).all() and (angle_increment == angle_increment[0]).all()
    rows = slice(0, 1) if is_same else slice(None)
    bearings = angle_min[rows, None] + angle_increment[rows, None] * np.arange(ranges.shape[1])
    # Readings nearer than this, (1, B) or (S, B), are left out.
    limits = np.zeros(bearings.shape, dtype=ranges.dtype)
    for sector in sectors:
        chosen = in_sectors(bearings, [sector[:2]])
        limits[chosen] = np.maximum(limits[chosen], sector[2] if len(sector) > SECTOR_PARTS else np.inf)
    chosen = (ranges < limits) | np.isposinf(limits)
    count = int(np.count_nonzero(chosen & ~np.isnan(ranges)))
    ranges[chosen] = np.nan
    return count


def in_sectors(bearings: Array, sectors: Sequence[Bearings]) -> Mask:
    """Which of some bearings, rad, are in one of the sectors of which nothing is read; of the same shape."""
    chosen = np.zeros(bearings.shape, dtype=np.bool_)
    for first, last in (sector for sector in sectors if len(sector) == SECTOR_PARTS):
        chosen |= (
            np.mod(bearings - first + BEARING_ROUNDING, 2 * np.pi)
            <= _width(first, last) + 2 * BEARING_ROUNDING
        )
    return chosen


def _width(first: float, last: float) -> float:
    """The angle from the first bearing counter-clockwise to the last, rad."""
    return last - first if 0 <= last - first <= 2 * math.pi else (last - first) % (2 * math.pi)
