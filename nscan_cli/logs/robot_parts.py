"""Beams that see the robot itself: its posts, its wheels, a cart behind it.

Such a beam keeps its range whatever the robot does. So does one to a wall along which the robot drives, until
it turns. Turns are taken from the scans alone, because odometry may be missing or wrong: the ranges of one
scan, shifted by some beams, resemble those of a later one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_defaults import mark_no_returns
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.poses import Array


@dataclass(frozen=True)
class RobotPartsOptions:
    """When a beam sees the robot itself."""

    max_range: float = 2.5
    """Range up to which parts of the robot are looked for, m. No real log has any up to here, nor has an
    excerpt of 300 or 800 scans. A larger value finds longer booms and carts."""
    relative_tolerance: float = 0.1
    """Greatest deviation of a constant range from its median, as a share of that. A larger value finds looser
    parts, and more walls of corners in which the robot turns."""
    min_tolerance: float = 0.02
    """Deviation that is always allowed, for noise, m. A larger value suits poorer lasers."""
    max_tolerance: float = 0.05
    """Largest deviation that is allowed, m. A larger value finds looser parts."""
    min_share: float = 0.6
    """Least share of all scans in which the range is constant. A larger value misses what was added later."""
    min_turning_share: float = 0.85
    """Least share of scans in turns in which the range is constant. For a wall at the side it is two thirds
    in a turn at a corner, where another wall comes next. A smaller value finds parts that the laser often
    misses."""
    min_turn: float = np.radians(25.0)
    """Least turn between two scans, rad: it changes the range to any wall. A larger value takes less for
    parts."""
    max_turn: float = np.radians(60.0)
    """Largest turn between two scans that is looked for, rad. A larger value takes longer."""
    lags: tuple[float, ...] = (1.0, 3.0, 6.0)
    """Times between the scans of a pair, s, in which robots turn by `min_turn` and come a metre far. More
    take longer."""
    min_pairs: int = 10
    """Least number of pairs of scans between which the robot has turned. A larger value finds fewer parts."""
    max_mismatch: float = 0.5
    """A turn counts if the scans differ, once turned by it, by at most this share of their difference before.
    A larger value finds more turns, also false ones."""
    max_difference: float = 1.0
    """Ranges of two scans whose logarithms differ by more count as different by this. A larger value gives
    edges more weight."""
    min_compared_share: float = 0.25
    """Least share of beams that have a range in both scans, once turned. A larger value finds fewer turns."""
    max_hidden_share: float = 0.5
    """Greatest share of beams of constant range that are left out when turns are looked for. A larger value
    finds parts of the robot that hide more, and fewer in narrow corridors."""
    step: float = np.radians(2.0)
    """Interval between the turns that are tried, rad. A smaller value takes longer."""
    scans: int = 256
    """Number of scans that are looked at for constant ranges. A larger value takes longer."""
    pairs: int = 512
    """Number of pairs for each lag that are looked at, if there are constant ranges. A larger value takes
    longer."""
    scans_of_turn: int = 4
    """Number of scans from the first of a pair to the second whose ranges are compared. A larger value takes
    longer."""
    margin: float = np.radians(1.0)
    """Sectors are widened by this on each side, rad: a beam at an edge meets both. Gaps of twice this are
    closed. A larger value leaves out more."""


class Sector(NamedTuple):
    """Bearings in the laser's frame, from the first counter-clockwise to the last."""

    first: float
    """rad"""
    last: float
    """rad"""
    range: float
    """Median range in the sector, m."""


class ScanTable(NamedTuple):
    """The scans of a log in file order, as written."""

    ranges: NDArray[np.float32]
    """(S, B) m"""
    limits: RangeLimits
    angle_min: Array
    """(S,) rad"""
    angle_increment: Array
    """(S,) rad"""
    rows: NDArray[np.int64]
    """(S,) positions of the scans in order of time."""
    times: Array
    """(S,) in order, s."""

    def bearings(self, row: int) -> Array:
        """(B,) directions of the beams of a scan in file order, rad."""
        found: Array = self.angle_min[row] + self.angle_increment[row] * np.arange(self.ranges.shape[1])
        return found


def robot_parts(table: ScanTable) -> list[Sector]:
    """The sectors in which the robot itself is in view, by increasing bearing; none if it never turns."""
    options = RobotPartsOptions()
    # Increasing ones, of the scan with the finest step.
    bearings = np.sort(table.bearings(int(np.argmin(np.abs(table.angle_increment)))))
    some = ranges_at(table, evenly(len(table.rows), options.scans), bearings)
    constant, medians = _constant_beams(some)
    if not constant.any():
        return []
    turning = turning_scans(table, bearings, constant)
    if not len(turning):
        return []
    ranges = ranges_at(table, turning, bearings)
    constant &= _kept(ranges, medians).mean(axis=0) >= options.min_turning_share
    return _sectors(bearings, constant, medians, options.margin)


def evenly(size: int, most: int) -> NDArray[np.int64]:
    """At most `most` places, spread evenly over `size`."""
    return np.unique(np.linspace(0, size - 1, most).astype(np.int64))


def ranges_at(table: ScanTable, places: NDArray[np.int64], bearings: Array) -> NDArray[np.float32]:
    """Ranges (n, B), in m, of the scans at `places` (n,) in order of time; inf or nan where there is none."""
    rows = table.rows[places]
    ranges = table.ranges[rows]
    limits = table.limits.of(rows)
    mark_no_returns(ranges, limits.low, limits.high)
    beams = (bearings - table.angle_min[rows, None]) / table.angle_increment[rows, None]
    nearest = np.rint(beams).astype(np.int64)
    has = (nearest >= 0) & (nearest < ranges.shape[1])
    found = np.take_along_axis(ranges, np.clip(nearest, 0, ranges.shape[1] - 1), axis=1)
    found[~has] = np.nan
    return found


def _constant_beams(ranges: NDArray[np.float32]) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Which beams of scans (n, B) mostly have the same near range, and the median (B,) of that; else nan."""
    near = (ranges < RobotPartsOptions.max_range).mean(axis=0) >= RobotPartsOptions.min_share
    medians = np.full(ranges.shape[1], np.nan, dtype=np.float32)
    medians[near] = _medians_below(ranges[:, near], RobotPartsOptions.max_range)
    constant = near.copy()
    constant[near] = _kept(ranges[:, near], medians[near]).mean(axis=0) >= RobotPartsOptions.min_share
    return constant, medians


def _medians_below(ranges: NDArray[np.float32], limit: float) -> NDArray[np.float32]:
    """(B,) median of those of the ranges of scans (n, B) below a limit, of which each beam has some."""
    ordered = np.sort(np.where(ranges < limit, ranges, np.inf).T, axis=1)
    counts = np.isfinite(ordered).sum(axis=1)
    beams = np.arange(len(ordered))
    found: NDArray[np.float32] = (ordered[beams, (counts - 1) // 2] + ordered[beams, counts // 2]) / 2
    return found


def _kept(ranges: NDArray[np.float32], medians: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n, B) whether the ranges of scans equal the medians (B,) within the tolerance, m."""
    options = RobotPartsOptions()
    tolerance = np.clip(options.relative_tolerance * medians, options.min_tolerance, options.max_tolerance)
    kept: NDArray[np.bool_] = np.abs(ranges - medians) <= tolerance
    return kept


def turning_scans(table: ScanTable, bearings: Array, constant: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Places (n,) of scans in which the other beams show a turn of the robot; none if it turns too seldom."""
    options = RobotPartsOptions()
    found = np.zeros((0, 2), dtype=np.int64)
    for lag in options.lags:
        # In a longer time the robot mostly drives straight on before a turn, and behind it, between walls
        # that are as far away.
        if len(found) >= options.min_pairs:
            break
        first = evenly(len(table.times), options.pairs)
        second = np.searchsorted(table.times, table.times[first] + lag)
        inside = second < len(table.times)
        pairs = np.stack([first[inside], second[inside]], axis=1)
        turns = _turns(table, bearings, constant, pairs)
        found = np.concatenate([found, pairs[np.abs(turns) >= options.min_turn]])
    if len(found) < options.min_pairs:
        return np.zeros(0, dtype=np.int64)
    first, last = found.T
    return np.unique(np.linspace(first, last, options.scans_of_turn).astype(np.int64))


def _turns(table: ScanTable, bearings: Array, constant: NDArray[np.bool_], pairs: NDArray[np.int64]) -> Array:
    """(P,) turn between the scans of each pair, rad; 0 if no turn makes them alike."""
    options = RobotPartsOptions()
    apart = abs(float(bearings[min(1, len(bearings) - 1)] - bearings[0]))
    # A damaged file may have beams in one direction.
    every = max(round(min(options.step / apart, len(bearings))), 1) if apart > 0.0 else 1
    step = every * apart
    # Where most beams keep their range, along a corridor, these are of walls and show turns.
    hidden = constant if constant.mean() <= options.max_hidden_share else np.zeros_like(constant)
    sides = []
    for places in pairs.T:
        ranges = ranges_at(table, places, bearings)
        ranges[:, hidden] = np.nan
        ranges[~(np.isfinite(ranges) & (ranges > 0))] = np.nan
        sides.append(np.log(ranges[:, ::every]))
    one, other = sides
    most = min(int(options.max_turn / step) if step else 0, one.shape[1] - 1)
    differences = np.full((2 * most + 1, len(pairs)), np.inf)
    for shift in range(-most, most + 1):
        a = one[:, max(shift, 0) : one.shape[1] + min(shift, 0)]
        b = other[:, max(-shift, 0) : one.shape[1] + min(-shift, 0)]
        apart = np.minimum(np.abs(a - b), options.max_difference)
        there = np.isfinite(apart)
        compared = there.sum(axis=1)
        sums = np.where(there, apart, 0.0).sum(axis=1)
        enough = compared >= max(int(options.min_compared_share * one.shape[1]), 1)
        differences[shift + most, enough] = sums[enough] / compared[enough]
    best = differences.argmin(axis=0)
    least = differences[best, np.arange(len(pairs))]
    alike = least <= options.max_mismatch * differences[most]
    return np.where(alike & np.isfinite(least), (best - most) * step, 0.0)


def _sectors(
    bearings: Array, chosen: NDArray[np.bool_], medians: NDArray[np.float32], margin: float
) -> list[Sector]:
    """The chosen beams (B,) as sectors."""
    found: list[Sector] = []
    for beam in np.flatnonzero(chosen).tolist():
        bearing = float(bearings[beam])
        if found and bearing - margin <= found[-1].last + 1e-9:
            found[-1] = found[-1]._replace(last=bearing + margin)
        else:
            found.append(Sector(bearing - margin, bearing + margin, 0.0))
    inside = [chosen & (bearings >= sector.first) & (bearings <= sector.last) for sector in found]
    ranges = [float(np.median(medians[beams])) for beams in inside]
    return [sector._replace(range=distance) for sector, distance in zip(found, ranges, strict=True)]
