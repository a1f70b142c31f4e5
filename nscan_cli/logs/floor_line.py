"""The floor in view of a laser that is tilted: a straight line that goes along with it.

A plane laser that looks down meets the floor in a line, at a distance d straight down its tilt and at
d / cos(a) at an angle a to that. Nothing is seen beyond it, wherever the robot is and however it turns. To a
wall beside a robot that drives straight on this applies until it turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.beam_mask import Bearings, in_sectors
from nscan_cli.logs.robot_parts import ScanTable, evenly, ranges_at, turning_scans
from nscan_cli.poses import Array, Mask


@dataclass(frozen=True)
class FloorLineOptions:
    """When readings are of the floor."""

    scans: int = 256
    """Number of scans that are looked at, evenly spread. More take longer."""
    step: float = math.radians(2.0)
    """Interval between the bearings that are looked at, rad. A smaller value takes longer."""
    min_known_share: float = 0.6
    """Least share of these scans in which a bearing has a reading. A larger value finds less outdoors."""
    quantile: float = 0.9
    """The floor is as far as this quantile of the readings of a bearing. A smaller value finds floors that
    are seen in more than half of the scans, and also walls."""
    tolerance: float = 0.1
    """Readings are of the floor if they differ from its line by no more than this share. A larger value finds
    rougher floors, and more things that are no floor."""
    min_share: float = 0.2
    """Least share of the readings of a bearing that are of the floor. A smaller value finds floors that are
    seldom seen, and takes longer."""
    margin: float = 0.2
    """Readings that are nearer than the line by up to this share of their distance to it are left out, too: a
    robot that rocks sees the floor there. A larger value leaves out more walls."""
    half_width: float = math.radians(45.0)
    """The line is looked at up to this angle on both sides of its nearest point, rad: farther aside the floor
    is far away. A larger value finds less."""
    min_width: float = math.radians(24.0)
    """Least width of all bearings that see the line, rad. A smaller value finds narrower views, and more
    things that are no floor."""
    max_beyond_share: float = 0.02
    """Greatest share of readings beyond the line, in all scans and in those of turns. A larger value finds
    more things that are no floor."""
    max_distance: float = 10.0
    """Greatest distance of the line, m: farther away a tilt hides little. A larger value finds more."""


class FloorLine(NamedTuple):
    """The points (x, y) in the laser's frame with x · across[0] + y · across[1] = 1, m."""

    across: Array
    """(2,) 1/m."""

    @property
    def distance(self) -> float:
        """From the laser to its nearest point, m."""
        return 1.0 / float(np.hypot(*self.across))

    @property
    def bearing(self) -> float:
        """Of its nearest point, in the laser's frame, rad."""
        return float(np.arctan2(self.across[1], self.across[0]))

    def depths(self, ranges: Array, bearings: Array) -> Array:
        """The readings in bearings (of the same shape) as shares of their distance to the line; at most 0
        where it is not ahead."""
        along: Array = np.cos(bearings) * self.across[0] + np.sin(bearings) * self.across[1]
        return ranges * along

    @property
    def said(self) -> str:
        """What was found, for a message."""
        return (
            f"the laser is tilted and sees the floor: at {round(math.degrees(self.bearing))}° nothing is "
            f"beyond a straight line at {self.distance:.2f} m that turns with the robot; readings there are "
            "left out; --as-recorded uses them"
        )


def floor_line(table: ScanTable, sectors: Sequence[Bearings]) -> FloorLine | None:
    """The line of the floor in the scans of a log, outside some sectors; None if they show none, or the robot
    never turns."""
    options = FloorLineOptions()
    step = abs(float(table.angle_increment[table.rows[0]]))
    every = int(np.clip(np.round(options.step / max(step, 1e-12)), 1, max(table.ranges.shape[1], 1)))
    spacing = every * step
    bearings = np.sort(table.bearings(table.rows[0])[::every])
    bearings = bearings[~in_sectors(bearings, sectors)]
    ranges = ranges_at(table, evenly(len(table.rows), options.scans), bearings)
    line = _fitted(ranges, bearings, spacing)
    if line is None or not _ends_views(line, ranges, bearings, spacing):
        return None
    # Walls show the turns, and the floor none.
    without = table.ranges.copy()
    without_floor(without, table.angle_min, table.angle_increment, line)
    rest = table._replace(ranges=without)
    nothing: Mask = np.zeros(len(bearings), dtype=np.bool_)
    turning = turning_scans(rest, bearings, nothing)
    if not len(turning):
        return None
    seen = ranges_at(table, turning, bearings)
    return line if _ends_views(line, seen, bearings, spacing) else None


def _fitted(ranges: NDArray[np.float32], bearings: Array, spacing: float) -> FloorLine | None:
    """The line through the farthest readings of bearings (B,), `spacing` (rad) apart, in which many of the
    ranges (n, B) are."""
    options = FloorLineOptions()
    ordered = np.sort(np.where(np.isfinite(ranges), ranges, np.inf), axis=0)
    counts = np.isfinite(ordered).sum(axis=0)
    at = np.minimum((options.quantile * counts).astype(np.int64), len(ordered) - 1)
    ends = ordered[at, np.arange(len(bearings))].astype(np.float64)
    ends[~np.isfinite(ends)] = 0.0
    near = (np.abs(ranges - ends) <= options.tolerance * ends).sum(axis=0)
    used = (near >= options.min_share * counts) & (counts >= options.min_known_share * len(ranges))
    rows = np.stack([np.cos(bearings), np.sin(bearings)], axis=1) * ends[:, None]
    line = None
    for _ in range(4):
        if np.count_nonzero(used) * spacing < options.min_width:
            return None
        line = FloorLine(np.linalg.lstsq(rows[used], np.ones(np.count_nonzero(used)), rcond=None)[0])
        used &= np.abs(rows @ line.across - 1.0) <= options.tolerance
    return line


def _ends_views(line: FloorLine, ranges: NDArray[np.float32], bearings: Array, spacing: float) -> bool:
    """Whether many of the ranges (n, B) are on a line, over a wide enough view, and hardly any beyond it."""
    options = FloorLineOptions()
    if line.distance > options.max_distance:
        return False
    about = np.mod(bearings - line.bearing + np.pi, 2 * np.pi) - np.pi
    inside = np.abs(about) <= options.half_width
    known = np.isfinite(ranges[:, inside])
    depths = line.depths(np.where(known, ranges[:, inside], 0.0), bearings[inside])
    if not known.any():
        return False
    on_line = known & (np.abs(depths - 1.0) <= options.tolerance)
    is_seen = on_line.sum(axis=0) >= options.min_share * np.maximum(known.sum(axis=0), 1)
    beyond = np.count_nonzero(known & (depths > 1.0 + options.tolerance))
    is_end = beyond <= options.max_beyond_share * np.count_nonzero(known)
    return bool(is_end and np.count_nonzero(is_seen) * spacing >= options.min_width)


def without_floor(
    ranges: NDArray[np.float32], angle_min: Array, angle_increment: Array, line: FloorLine
) -> int:
    """Write nan for the readings of scans (S, B) on a line or beyond, in place; returns how many those were.

    angle_min, angle_increment: (S,), rad.
    """
    bearings = angle_min[:, None] + angle_increment[:, None] * np.arange(ranges.shape[1])
    # What returns nothing may be as far away as it likes.
    known = np.isfinite(ranges)
    is_floor = line.depths(np.where(known, ranges, 0.0), bearings) >= 1.0 - FloorLineOptions.margin
    count = int(np.count_nonzero(is_floor))
    ranges[is_floor] = np.nan
    return count
