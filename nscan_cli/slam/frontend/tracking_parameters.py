"""The parameters of tracking as its kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.matching.priors import MotionParameters
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingOptions


class TrackingParameters(NamedTuple):
    """The tracker's options as the kernels take them; see TrackingOptions."""

    half: float
    """Side (m) of a lattice cell of the map."""
    in_view: float
    """Up to so far (m) from where a scan was taken it had whole cells in view."""
    window: float
    step: float
    widenings: Array
    max_iterations: int
    near: float
    tolerance: float
    scale: float
    inlier_bound: float
    inlier_share: float
    far_share: float
    turns: Array
    """(rings, angles), with nan where a ring has fewer."""
    odometry: MotionParameters
    steady_motion: MotionParameters

    @classmethod
    def of(
        cls, options: TrackingOptions, odometry: bool = False, range_limit: float = np.inf
    ) -> TrackingParameters:
        """Those of the options, with odometry or without."""
        turns = np.full(
            (len(options.restart_angles), max(map(len, options.restart_angles), default=0)), np.nan
        )
        for ring, angles in zip(turns, options.restart_angles, strict=True):
            ring[: len(angles)] = angles
        return cls(
            0.5 * options.gaussians.cell,
            max(range_limit - options.gaussians.cell, 0.5 * range_limit),
            options.window,
            options.min_motion,
            np.array(options.widenings),
            options.max_iterations,
            options.coarse_tolerance if odometry else options.tolerance,
            options.tolerance,
            options.scale,
            options.inlier_bound,
            options.restart_inliers,
            options.far_restart_inliers,
            turns,
            MotionParameters.of(options.odometry),
            MotionParameters.of(options.constant_velocity),
        )
