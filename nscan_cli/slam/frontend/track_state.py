"""What the kernels of tracking work on: what is known between two scans, and the scans that are tracked."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.matching.motion_model import Prior
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.frontend.local_map import LocalMap
from nscan_cli.slam.frontend.odometry_noise import OdometryNoise
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.tracked_scans import TrackedScans

KNOWN, RESTARTS, NEXT, CONTRADICTIONS, HAS_LEFT, MAY_WAIT = 0, 1, 2, 3, 4, 5
"""Places in `TrackState.counts`: the number of the last poses that are known, how often matches were started
from other angles, the first scan of a batch whose pose is not known, how many of the last scans left the
odometry, whether the last one did for a place that a search found, and whether a lost one may wait."""


class TrackState(NamedTuple):
    """The state of tracking, which its kernels change."""

    poses: Array
    """(h, 3) poses of the last scans, the newest last."""
    times: Array
    """(h,) times of these scans, s."""
    odometry: Array
    """(3,) pose of the last matched scan by odometry; nan without odometry."""
    inserted: Array
    """(3,) pose of the last scan that joined the map."""
    inliers: Array
    """(2,) shares of inliers of the last scan, and of the first one since then that waits for motion and was
    matched from other angles in vain; infinity if there is none."""
    mean_square_deviation: Array
    """(1,) mean square deviation of scans from their predictions without odometry, m²."""
    prediction_errors: Array
    """(2, 2, h − 1) mean error of the place (m) and the turn (rad) as predicted by the mean velocity of the
    last 1 to h − 1 steps, per scan and per second."""
    odometry_noise: OdometryNoise
    counts: NDArray[np.int64]
    """(6,) KNOWN, RESTARTS, NEXT, CONTRADICTIONS, HAS_LEFT and MAY_WAIT"""
    map: LocalMap

    @classmethod
    def begin(cls, size: int, options: ScanTrackingOptions) -> TrackState:
        """The state before the first scan, with room for the last `size` poses."""
        poses, odometry, inserted = np.zeros((size, 3)), np.full(3, np.nan), np.zeros(3)
        inliers = np.array([0.0, np.inf])
        deviation, counts = np.array([options.degeneracy.initial_sigma**2]), np.zeros(6, dtype=np.int64)
        noise, empty = OdometryNoise.begin(), LocalMap.empty()
        errors = np.full((2, 2, size - 1), options.initial_prediction_error)
        return cls(
            poses, np.zeros(size), odometry, inserted, inliers, deviation, errors, noise, counts, empty
        )


class TrackingProblem(NamedTuple):
    """n successive scans that are tracked, one after another."""

    track: TrackState
    grid: Grid
    """The Gaussians of the local map."""
    settings: TrackingParameters
    points: Array
    """(P, 2) one scan after another, each in its robot's frame. They are corrected in place."""
    ends: Indices
    """(n + 1,) scan k has points[ends[k] : ends[k + 1]]."""
    shares: Array
    """(P,) times of the points as in ScanBatch; empty if there is nothing to correct."""
    times: Array
    """(n,) s"""
    odometry: Array
    """(n, 3) poses, nan where there is none."""
    prior: Prior
    """The prior of the scan that is matched now; each scan overwrites it."""
    found: TrackedScans
    """What is found of the n scans, to be filled."""
