"""Scans as tracking takes them: some successive scans of the log, with all points in one array."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from nscan_cli.logs.blind_scans import least_returns
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices, are_known
from nscan_cli.slam.frontend.odometry_checks import SHORTEST_PERIOD
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.point_spacing import spaced_points

NONE = np.zeros(0)
SCANS_PER_BATCH = 128
"""Scans that are tracked together, before the keyframes among them are chosen."""


@dataclass(frozen=True)
class ScanBatch:
    """n scans that follow each other, and their odometry."""

    first: int
    """Row of the first scan in the log."""
    points: Array
    """(P, 2) points of these and maybe other scans, one after another, each in its robot's frame."""
    ends: Indices
    """(n + 1,) scan k has points[ends[k] : ends[k + 1]]."""
    times: Array
    """(n,) s"""
    odometry: Array | None
    """(n, 3) poses of the robot, or None."""
    shares: Array = field(default_factory=lambda: NONE)
    """(P,) times of the points from the middle of the laser's sweep, in periods of the scans, where tracking
    is to correct them; else empty."""

    def __len__(self) -> int:
        return len(self.ends) - 1

    def of(self, k: int) -> Array:
        """The points (m, 2) of scan k."""
        return self.points[self.ends[k] : self.ends[k + 1]]

    def part(self, first: int, end: int) -> ScanBatch:
        """The scans from the `first` on, before the `end`."""
        odometry = None if self.odometry is None else self.odometry[first:end]
        ends, times = self.ends[first : end + 1], self.times[first:end]
        return ScanBatch(self.first + first, self.points, ends, times, odometry, self.shares)

    def copied(self) -> ScanBatch:
        """The same scans, with points and shares of their own."""
        return ScanBatch.together([self])

    def correct(self, corrected: ScanBatch) -> None:
        """Take over points and shares of a copy of the first of these scans, in place."""
        first, end = self.ends[0], self.ends[len(corrected)]
        mine, theirs = slice(first, end), slice(corrected.ends[0], corrected.ends[-1])
        self.points[mine], self.shares[mine] = corrected.points[theirs], corrected.shares[theirs]

    def backwards(self, poses: Array) -> ScanBatch:
        """A copy of the scans from the last to the first, as if time went backwards.

        Its odometry are the poses (n, 3) of the scans, in their own order.
        """
        order = np.arange(len(self))[::-1]
        points, ends = self.chosen(order)
        shares = np.concatenate([self.shares[self.ends[k] : self.ends[k + 1]] for k in order])
        # A view in the other order is another type for kernels, which would be compiled again.
        return ScanBatch(self.first, points, ends, -self.times[::-1], poses[::-1].copy(), -shares)

    def chosen(self, chosen: Indices) -> tuple[Array, Indices]:
        """A copy of the points (P, 2) of the scans with indices `chosen` (c,), and their `ends` (c + 1,)."""
        points = np.concatenate([self.points[:0], *(self.of(k) for k in chosen)])
        return points, np.append(0, np.cumsum(np.diff(self.ends)[chosen]))

    @classmethod
    def together(cls, parts: Sequence[ScanBatch]) -> ScanBatch:
        """The scans of several batches, each of which begins where the one before ends."""
        scans = [part.chosen(np.arange(len(part))) for part in parts]
        sizes = np.concatenate([np.diff(ends) for _, ends in scans])
        shares = [part.shares[part.ends[0] : part.ends[-1]] for part in parts]
        odometry = [part.odometry for part in parts if part.odometry is not None]
        return cls(
            parts[0].first,
            np.concatenate([points for points, _ in scans]),
            np.concatenate([[0], np.cumsum(sizes)]),
            np.concatenate([part.times for part in parts]),
            np.concatenate(odometry) if odometry else None,
            np.concatenate(shares),
        )


def scan_batches(
    log: LaserLog, options: TrackingOptions, odometry: Array | None, frozen: Indices
) -> Iterator[ScanBatch]:
    """The scans of a log, batch by batch: the points that are matched, and the odometry (S, 3), if any.

    Scans in the `frozen` rows (H,) have no points, and none that have few and odometry.
    """
    # Along a path they are corrected already.
    is_swept = log.beam_times is not None and log.path is None and len(log) > 1
    period = max(float(np.median(np.diff(log.times))), SHORTEST_PERIOD) if is_swept else 1.0
    least = least_returns(log.ranges.shape[1], options.min_points)
    for first in range(0, len(log), SCANS_PER_BATCH):
        rows, shares = slice(first, min(first + SCANS_PER_BATCH, len(log))), NONE
        if is_swept:
            points, ends, times = log.timed_points(rows, options.max_range)
            shares = times / period
        else:
            points, ends = log.batch_points(rows, options.max_range)
        kept = spaced_points(points, ends, options.point_spacing, options.spacing_neighbours)
        is_left_out = np.isin(np.arange(first, rows.stop), frozen)
        if odometry is not None:
            is_left_out |= (np.diff(ends) < least) & are_known(odometry[rows])
        kept &= np.repeat(~is_left_out, np.diff(ends))
        if not kept.all():
            points, shares = points[kept], shares[kept] if is_swept else NONE
            ends = np.concatenate([[0], np.cumsum(kept)])[ends]
        known = None if odometry is None else odometry[rows]
        yield ScanBatch(first, points, ends, log.times[rows], known, shares)
