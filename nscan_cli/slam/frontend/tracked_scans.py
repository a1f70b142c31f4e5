"""What tracking finds of a scan (paper, V), and of many as columns, which its kernels fill."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array, Indices
from nscan_cli.slam.frontend.scan_batch import ScanBatch


@dataclass(frozen=True)
class TrackedScan:
    """What tracking found of one scan."""

    pose: Array
    """(3,) pose of the robot in the tracker's frame."""
    hessian: Array
    """(3, 3) Hessian of scale · E there, without the prior."""
    prior_covariance: Array
    """(3, 3) covariance of the step to here before the match, by odometry or by constant velocity."""
    inliers: float
    """Share of the points that lie on a Gaussian of the map."""
    path: float
    """Length of the path up to here, m."""
    in_map: bool
    """Whether the scan's points joined the local map."""
    guess_variances: Array = field(default_factory=lambda: np.zeros(2))
    """(2,) variances of the place (m²) and the turn (rad²) of the way to here, where it is a guess."""


class TrackedScans(NamedTuple):
    """What tracking finds of n scans, as TrackedScan says, and the objective of each match."""

    values: Array
    """(n,) values of the objective."""
    poses: Array
    """(n, 3)"""
    hessians: Array
    """(n, 3, 3)"""
    prior_covariances: Array
    """(n, 3, 3)"""
    inliers: Array
    """(n,)"""
    paths: Array
    """(n,)"""
    in_map: NDArray[np.bool_]
    """(n,)"""
    odometry_sigmas: Array
    """(n,) distance from where the odometry has the scan, in standard deviations; 0 without odometry."""
    weakest_sigmas: Array
    """(n,) standard deviation of the position that a scan without odometry measures along its weakest
    direction, m; 0 where no direction is weak, infinite where it fits nothing."""
    guess_variances: Array
    """(n, 2) variances of the place (m²) and the turn (rad²) of the way here from the scans before. They are
    not 0 if scans fit nothing that was seen before, and this one only the last of these."""

    @classmethod
    def room(cls, n: int) -> TrackedScans:
        """Columns for n scans, to be filled."""
        values, inliers, paths, sigmas = np.empty((4, n))
        hessians, covariances = np.empty((2, n, 3, 3))
        in_map = np.empty(n, dtype=np.bool_)
        poses, told = np.empty((n, 3)), np.zeros(n)
        guesses = np.zeros((n, 2))
        return cls(values, poses, hessians, covariances, inliers, paths, in_map, sigmas, told, guesses)

    @classmethod
    def together(cls, parts: Iterable[TrackedScans]) -> TrackedScans:
        """What was found of several batches, one after another."""
        return cls(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    def part(self, first: int, end: int) -> TrackedScans:
        """What was found of the scans from the `first` on, before the `end`."""
        return self.of(slice(first, end))

    def of(self, rows: slice | Indices) -> TrackedScans:
        """What was found of the scans in some rows."""
        columns: Iterable[Any] = (column[rows] for column in self)
        return TrackedScans(*columns)

    def scan(self, k: int) -> TrackedScan:
        """What was found of one scan, with arrays of its own."""
        return TrackedScan(
            self.poses[k].copy(),
            self.hessians[k].copy(),
            self.prior_covariances[k].copy(),
            float(self.inliers[k]),
            float(self.paths[k]),
            bool(self.in_map[k]),
            self.guess_variances[k].copy(),
        )


@dataclass(frozen=True)
class TrackedBatch:
    """Scans of one track segment, and where tracking found them."""

    scans: ScanBatch
    tracked: TrackedScans
    starts_segment: bool = False
    """Whether a new segment starts with the first of the scans."""
    after_break: bool = False
    """Whether the track broke before it: the motion to there is unknown."""

    def __len__(self) -> int:
        return len(self.scans)

    def part(self, first: int, end: int) -> TrackedBatch:
        """The scans from the `first` on, before the `end`."""
        scans, tracked = self.scans.part(first, end), self.tracked.part(first, end)
        return TrackedBatch(
            scans, tracked, self.starts_segment and first == 0, self.after_break and first == 0
        )

    def one(self, k: int) -> TrackedBatch:
        """One of the scans; counted from the end if k is negative."""
        k %= len(self)
        return self.part(k, k + 1)
