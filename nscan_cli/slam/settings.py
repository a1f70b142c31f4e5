"""The parameters of tracking as its kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.matching.priors import Motion
from nscan_cli.poses import Array
from nscan_cli.slam.options import TrackingOptions


class Settings(NamedTuple):
    """The tracker's options as the kernels take them; see TrackingOptions."""

    half: float
    """Side (m) of a lattice cell of the map."""
    minimum: float
    floor: float
    faces: bool
    """Whether each face of a wall on the map is a Gaussian of its own. Without odometry none is: exact ones
    hold the robot where it is in corridors that come into view, as nothing else does."""
    window: float
    step: float
    widenings: Array
    max_iterations: int
    tolerance: float
    thorough: bool
    """As in minimise. Without odometry a start is a guess, and now and then the longer way the right one."""
    scale: float
    inlier_bound: float
    inlier_share: float
    odometry: Motion
    steady_motion: Motion

    @classmethod
    def of(cls, options: TrackingOptions, odometry: bool = True) -> Settings:
        """Those of the options, for scans with odometry or without."""
        gaussians = options.gaussians
        return cls(
            0.5 * gaussians.cell,
            float(gaussians.minimum),
            gaussians.floor,
            odometry,
            options.window,
            options.step,
            np.array(options.widenings),
            options.max_iterations,
            options.tolerance,
            not odometry,
            options.scale,
            options.inlier_bound,
            options.inlier_share,
            Motion.of(options.odometry),
            Motion.of(options.steady_motion),
        )
