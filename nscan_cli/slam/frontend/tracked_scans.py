"""What tracking finds of scans (paper, V): of many as columns, which its kernels fill, or of one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array


@dataclass(frozen=True)
class Tracked:
    """Where a scan was found."""

    pose: Array
    """(3,) of the robot in the tracker's frame."""
    hessian: Array
    """(3, 3) of scale · E there, without the prior."""
    expected: Array
    """(3, 3) covariance of the step to here before the match: the odometry's, or of steady motion."""
    inliers: float
    """Share of the points that lie on a Gaussian of the map."""
    path: float
    """Length of the path up to here, m."""
    joined: bool
    """Whether the scan's points joined the map."""
    off: float = 0.0
    """How far it lies off where the odometry has it, in standard deviations of the place; 0 without any."""


class TrackedScans(NamedTuple):
    """What tracking finds of n scans, each as Tracked says."""

    values: Array
    """(n,) the objective's."""
    poses: Array
    """(n, 3)"""
    hessians: Array
    """(n, 3, 3)"""
    expected: Array
    """(n, 3, 3)"""
    inliers: Array
    """(n,)"""
    paths: Array
    """(n,)"""
    joined: NDArray[np.bool_]
    """(n,)"""
    off: Array
    """(n,)"""

    @classmethod
    def room(cls, n: int) -> TrackedScans:
        """For so many scans."""
        values, inliers, paths, off = np.empty((4, n))
        hessians, expected = np.empty((2, n, 3, 3))
        joined = np.empty(n, dtype=np.bool_)
        return cls(values, np.empty((n, 3)), hessians, expected, inliers, paths, joined, off)

    @classmethod
    def together(cls, parts: Iterable[TrackedScans]) -> TrackedScans:
        """Several, one after another."""
        return cls(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    def part(self, first: int, end: int) -> TrackedScans:
        """Those of the scans from the `first` on, before the `end`."""
        columns: Iterable[Any] = (column[first:end] for column in self)
        return TrackedScans(*columns)

    def scan(self, k: int) -> Tracked:
        """That of one scan, with arrays of its own."""
        return Tracked(
            self.poses[k].copy(),
            self.hessians[k].copy(),
            self.expected[k].copy(),
            float(self.inliers[k]),
            float(self.paths[k]),
            bool(self.joined[k]),
            float(self.off[k]),
        )
