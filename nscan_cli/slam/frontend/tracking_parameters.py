"""The parameters of tracking as its kernels take them."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any, NamedTuple

import numpy as np

from nscan_cli.matching.priors import MotionParameters
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingOptions


class DegeneracyParameters(NamedTuple):
    """The fields of DegeneracyOptions."""

    max_information_ratio: float
    profile_sigmas: float
    profile_step: float
    rematch_gain: float
    trusted_sigma: float
    initial_sigma: float
    smoothing: float
    deviation_factor: float
    min_deviation: float


class TrackingParameters(NamedTuple):
    """The fields of TrackingOptions that kernels use, and what follows from the log."""

    half: float
    """Side of a lattice cell of the map, m."""
    visible_range: float
    """Distance from where a scan was taken up to which it had whole cells in view, m."""
    window: float
    min_motion: float
    widenings: Array
    max_iterations: int
    coarse_tolerance: float
    tolerance: float
    scale: float
    inlier_bound: float
    restart_inliers: float
    inlier_margin: float
    restart_angles: Array
    """(rings, angles), with nan where a ring has fewer."""
    far_restart_inliers: float
    lost_inliers: float
    odometry: MotionParameters
    constant_velocity: MotionParameters
    degeneracy_poses: int
    degeneracy: DegeneracyParameters

    @classmethod
    def of(
        cls, options: TrackingOptions, has_odometry: bool = False, range_limit: float = np.inf
    ) -> TrackingParameters:
        """Those for a log with or without odometry, whose laser has this range limit (m)."""
        rings = options.restart_angles
        angles = np.full((len(rings), max(map(len, rings), default=0)), np.nan)
        for row, ring in zip(angles, rings, strict=True):
            row[: len(ring)] = ring
        values: dict[str, Any] = {name: getattr(options, name, None) for name in cls._fields}
        values |= {
            "half": 0.5 * options.gaussians.cell,
            "visible_range": max(range_limit - options.gaussians.cell, 0.5 * range_limit),
            "widenings": np.array(options.widenings),
            "coarse_tolerance": options.coarse_tolerance if has_odometry else options.tolerance,
            "restart_angles": angles,
            "odometry": MotionParameters.of(options.odometry),
            "constant_velocity": MotionParameters.of(options.constant_velocity),
            "degeneracy": DegeneracyParameters(*astuple(options.degeneracy)),
        }
        return cls(**values)
