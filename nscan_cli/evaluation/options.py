"""The options of an evaluation: which poses are compared, how they are aligned, and what is remarked."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class AlignmentOptions:
    """When headings decide the angle of an alignment, and not positions."""

    position_error: float = 0.02
    """Error of positions that is always assumed, m. A larger value lets headings decide more often."""
    max_angle_sigma: float = 0.2
    """Largest sigma of an angle by positions, rad. A larger value lets headings decide less often."""
    driven_distance: float = 0.3
    """Least common motion (RMS) with which positions decide, m. With a larger value, headings do."""


@dataclass(frozen=True)
class ClockLagOptions:
    """How the lag between two clocks is searched, and when it is certain."""

    max_lag: float = 120.0
    """Largest lag that is searched, s. A larger value is searched in larger steps."""
    min_lag: float = 0.05
    """Smallest lag that is told, s. A larger value tells fewer lags."""
    steps: int = 400
    """Number of steps of the first search, whose best lag is refined. A larger value takes longer."""
    max_poses: int = 500
    """Number of poses of the result that are compared, evenly spread. A larger value takes longer."""
    min_poses: int = 20
    """Least poses of paths without a common time: any two short paths fit. A larger value finds less."""
    kept_poses: float = 0.6
    """Least share of the overlapping poses that a lag must keep. A larger value finds less."""
    kept_motion: float = 0.5
    """Least share of the motion in the overlapping poses that a lag must keep. A larger value finds less."""
    min_kept_poses: int = 10
    """Least number of overlapping poses that a lag must keep. A larger value finds less."""
    other_lag: float = 1.0
    """Least difference of another lag, which must be worse, from the best, s. A larger value finds more."""
    other_steps: float = 10.0
    """Another lag is also at least so many steps of the first search from the best. A larger value finds
    more."""
    refinements: int = 4
    """How often the best lag is refined. A larger number is more exact, and takes longer."""
    refined_steps: int = 10
    """Number of steps to both sides in each refinement; those of the next one are as many times smaller. A
    larger number is more exact, and takes longer."""
    cost_ratio: float = 1.5
    """Least ratio of the cost of any other lag to that of the best. A larger value finds less."""


@dataclass(frozen=True)
class RemarkOptions:
    """When a difference between a result and its reference is certain, and worth a remark."""

    min_motion: float = 0.2
    """Least motion of a path that shows differences, m (RMS about the mean). A larger value remarks less."""
    max_residual: float = 0.1
    """Largest residual of a path with the remark, as a share of its motion. A larger value remarks more."""
    improvement: float = 3.0
    """Least ratio of the residuals without and with the remark. A larger value remarks less."""
    lever_improvement: float = 2.0
    """Least ratio of the residuals without and with another point of the robot. A larger value remarks
    less."""
    as_good: float = 1.5
    """Largest ratio of the residuals of two equal explanations. A larger value prefers the simpler one."""
    rounding: float = 1e-5
    """Residual that may be rounding, as a share of the motion. A larger value prefers the simpler one."""
    min_sigmas: float = 5.0
    """Least size of a turn or of a lever arm, in standard deviations. A larger value remarks less."""
    min_turn: float = math.radians(3.0)
    """Least turn of the headings, rad. A larger value remarks less."""
    min_lever: float = 0.05
    """Least distance between two points of the robot, m. A larger value remarks less."""
    min_factor: float = 0.03
    """Least factor between two units, as a logarithm. A larger value remarks less."""
    unit_tolerance: float = 0.03
    """Largest relative error of a factor that is given the name of a unit. A larger value names more."""
    max_side_turn: float = math.radians(170.0)
    """Largest turn of the headings that is given a side, rad. A larger value gives more turns a side."""
    max_condition: float = 1e8
    """Largest condition number with which headings tell another point of the robot. A larger value remarks
    more."""
    max_height: float = 0.2
    """Largest range of heights of a path in the plane, m. A larger value remarks less."""
    max_tilt: float = math.radians(5.0)
    """Largest tilt of a path in the plane, rad. A larger value remarks less."""
    height_outliers: float = 1.0
    """Share of the heights that are left out on both sides of that range, in percent. A larger value remarks
    less."""
    tilt_outliers: float = 5.0
    """Share of the tilts that may be larger, in percent. A larger value remarks less."""
    path_ratio: float = 2.0
    """Least ratio of a path by time to that by the file, of two runs. A larger value remarks less."""
    repeated_share: float = 0.05
    """Least share of repeated stamps in a file of two runs. A larger value remarks less."""
    min_repeated: int = 3
    """Least number of repeated stamps in a file of two runs. A larger value remarks less."""
    repeated_distance: float = 0.05
    """Least distance between poses of the same stamp in two runs, m. A larger value remarks less."""
    clock_lag: ClockLagOptions = ClockLagOptions()
    """When the clocks of result and reference differ."""


@dataclass(frozen=True)
class EvaluationOptions:
    """All options of an evaluation."""

    tolerance: float = 0.1
    """Largest time between two poses that match (Kümmerle's metric), s. A larger value compares more."""
    relative_distance: float = 1.0
    """Path in the reference between the two poses of a relative error, m. Over a larger value, errors
    grow."""
    alignment: AlignmentOptions = AlignmentOptions()
    """When headings decide the alignment of result and reference."""
    remarks: RemarkOptions = RemarkOptions()
    """When a difference is worth a remark."""
