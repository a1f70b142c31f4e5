"""The beams that a log is read without: those that --mask names, or those that see the robot itself."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_parts import RobotPartsOptions, ScanTable, Sector, robot_parts
from nscan_cli.poses import Array

Bearings = tuple[float, float]
"""A sector from the first counter-clockwise to the last, in the laser's frame, rad."""
BEARING_ROUNDING = 1e-5
"""rad; messages have 32 bits, logs and --mask have decimals of degrees."""


def masked_sectors(
    table: ScanTable, options: ReadingOptions, parts: RobotPartsOptions
) -> tuple[list[Bearings], list[str]]:
    """The sectors that are not read, and what is said of them."""
    if options.mask is not None:
        return list(options.mask), []
    found = [] if options.as_recorded else robot_parts(table, parts)
    return [(sector.first, sector.last) for sector in found], [_said(found)] if found else []


def _said(found: Sequence[Sector]) -> str:
    ranges = " and ".join(f"{distance:.2f}" for distance in sorted({round(one.range, 2) for one in found}))
    return (
        f"beams keep their range ({ranges} m) while the robot turns, so they see the robot itself; they are "
        f"left out, as by --mask {mask_text([sector[:2] for sector in found])}; --as-recorded uses them"
    )


def mask_text(sectors: Sequence[Bearings]) -> str:
    """Sectors (rad) as --mask takes them, in degrees."""
    degrees = ((math.degrees(first), math.degrees(last)) for first, last in sectors)
    return ",".join(f"{round(first, 1):g}:{round(last, 1):g}" for first, last in degrees)


def mask_beams(
    ranges: NDArray[np.float32], angle_min: Array, angle_increment: Array, sectors: Sequence[Bearings]
) -> int:
    """Write nan for the beams of scans (S, B) in the sectors, in place; returns how many readings that were.

    angle_min, angle_increment: (S,), rad.
    """
    if not sectors:
        return 0
    is_same = (angle_min == angle_min[0]).all() and (angle_increment == angle_increment[0]).all()
    rows = slice(0, 1) if is_same else slice(None)
    bearings = angle_min[rows, None] + angle_increment[rows, None] * np.arange(ranges.shape[1])
    chosen = np.zeros(bearings.shape, dtype=np.bool_)
    for first, last in sectors:
        chosen |= (
            np.mod(bearings - first + BEARING_ROUNDING, 2 * np.pi)
            <= _width(first, last) + 2 * BEARING_ROUNDING
        )
    chosen = np.broadcast_to(chosen, ranges.shape)
    count = int(np.count_nonzero(chosen & ~np.isnan(ranges)))
    ranges[chosen] = np.nan
    return count


def _width(first: float, last: float) -> float:
    """The angle from the first bearing counter-clockwise to the last, rad."""
    return last - first if 0 <= last - first <= 2 * math.pi else (last - first) % (2 * math.pi)
