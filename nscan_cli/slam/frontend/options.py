"""The parameters of tracking, and what follows from them and from the log."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from nscan_cli.matching.motion_model import MotionModel
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.odometry_noise import OdometryNoiseOptions


class DegeneracyOptions(NamedTuple):
    """When and how far a scan without odometry keeps to its prediction, in a direction it tells little of."""

    max_information_ratio: float = 0.12
    """A direction is checked if it has less than this share of the information across it. A larger value
    checks more scans."""
    profile_sigmas: float = 2.5
    """Half length of the line on which the objective is sampled, in standard deviations of the prediction. A
    larger value takes longer."""
    profile_step: float = 0.03
    """Distance between the samples, m. No wall's Gaussian is narrower. A larger value is faster and
    coarser."""
    rematch_gain: float = 3.0
    """The scan is also matched from the best sample if the objective is lower there by more than this. A
    larger value is faster."""
    trusted_sigma: float = 0.04
    """A scan that tells its place on the line to this standard deviation stays where it was matched, m. A
    larger value trusts matches more than predictions."""
    initial_sigma: float = 0.05
    """Root mean square deviation of scans from their predictions before any is known, m. A larger value
    trusts the first matches more."""
    smoothing: float = 0.02
    """Weight of a new scan in that mean square. A larger weight follows changes of the motion faster."""
    deviation_factor: float = 3.5
    """Multiple of that deviation that is allowed. A larger factor trusts matches more than predictions."""
    min_deviation: float = 0.03
    """Least deviation that is allowed, m. A larger value trusts matches more."""


class ScanTrackingOptions(NamedTuple):
    """How each scan is tracked: what kernels take as it is."""

    window: float = 12.0
    """Length of the path whose scans the local map holds, m. A longer window drifts less and costs memory."""
    min_motion: float = 0.05
    """A scan joins the local map when the robot has moved farther (m) or turned more (rad) than this since
    the last one that joined. Odometry that has moved less (m) may stand while the robot is carried. A larger
    value makes the map sparser."""
    max_iterations: int = 20
    """Largest number of Newton steps of a stage. A larger number lets slow matches converge."""
    tolerance: float = 1e-4
    """The last stage ends with a step shorter than this, m and rad; without odometry all stages do. A larger
    value ends them earlier."""
    scale: float = 0.1
    """Weight of the energy against the prior. It is small, since four Gaussians see each point and
    neighbouring points hit the same wall. A larger weight trusts the odometry less."""
    inlier_bound: float = 9.0
    """Largest squared Mahalanobis distance of an inlier. A larger value counts more points."""
    restart_inliers: float = 0.8
    """With a smaller share of inliers a match starts again from other angles: one that is off by 12° can have
    0.7. With odometry it also starts again if the scan before had more by `inlier_margin`. A larger value
    restarts more."""
    inlier_margin: float = 0.05
    """Difference of two shares of inliers that counts. A larger value keeps first matches more often."""
    clear_inliers: float = 0.9
    """A scan with a larger share of inliers sees clearly. A larger value restarts less."""
    clear_inlier_drop: float = 0.1
    """Without odometry a match starts again if its share of inliers is lower by this than that of a clear
    scan before it. A larger value restarts less."""
    far_restart_margin: float = 0.3
    """Rings after the first are tried only if the share is too small by more than this: outdoors most scans
    have few inliers. A larger value is faster."""
    lost_inliers: float = 0.3
    """With a smaller share of inliers a scan with odometry is searched among the last ones; without odometry
    `restart_inliers` decides. It is also the least score of a place that the search finds. A larger value
    searches more and accepts less."""
    carried_drop: float = 0.37
    """Where odometry stands, a scan with a share of inliers that is smaller by this than that of the scan
    before is searched too: the robot may be carried. A larger value searches less."""
    match_motion: float = 0.1
    """With odometry a scan is matched when the robot has moved this far (m) or turned this much (rad) since
    the last one that was. The scans between follow. Larger values drift less and see less."""
    sweep_step_change: float = 0.02
    """Without odometry a scan of a laser that turns is deskewed and matched again if its step differs by
    more than this (m, rad) from the one that it was deskewed by. Larger values take less time, and blur the
    map where the robot begins to turn."""
    max_waiting: int = 100
    """Most scans between two that are matched: a robot may stand for hours. More take more memory."""
    trusted_odometry: MotionModel = MotionModel(distance=0.02)
    """Standard deviations of the odometry from one matched scan to the next, as a prior of the match. Larger
    ones trust the scans more."""
    odometry_noise: OdometryNoiseOptions = OdometryNoiseOptions()
    """How these standard deviations shrink as the odometry proves good."""
    contradiction_sigmas: float = 2.0
    """A match that is off that prior by more standard deviations is repeated with the prior of `odometry`. A
    larger value trusts the odometry more."""
    odometry: MotionModel = MotionModel()
    """Standard deviations of the odometry where scans contradict it. Larger ones trust the scans more."""
    between_sigma: float = 0.05
    """Standard deviation of a scan between two matched ones from its place by odometry, m and rad. A larger
    value trusts the odometry less."""
    least_between_step: float = 1e-4
    """Each step between two matched scans counts as this long at least, m and rad, so that no covariance of a
    step is zero. A larger value spreads the error of odometry more evenly over the scans."""
    constant_velocity: MotionModel = MotionModel(distance=0.3, angle=0.3, distance_per_metre=0.3)
    """Standard deviations of a step without odometry, predicted by constant velocity. Larger ones trust the
    scans more."""
    longest_pause: float = 2.0
    """Largest time between two scans, in periods of the last ones, that a robot of constant velocity goes on
    in. A larger value predicts longer steps after pauses."""
    prediction_smoothing: float = 0.02
    """Weight of a new scan in the mean errors of predictions by constant velocity. A larger weight follows
    changes of the motion faster."""
    initial_prediction_error: float = 0.1
    """Mean error of predictions before any is known, m and rad. A larger value trusts the first matches
    more."""
    prediction_sigmas: float = 3.0
    """A poor match without odometry that is farther from its prediction than this, in mean errors of
    predictions, is repeated with a prior of this standard deviation. A larger value trusts matches more."""
    min_prediction_error: float = 0.02
    """Least mean error of predictions there, m and rad. A larger value trusts the scans more."""
    max_surprise: float = 10.0
    """Most that the objective of a pose grows because it is farther off than predictions usually are: now and
    then a robot does what it never did. A larger value trusts predictions more."""
    max_odometry_surprise: float = 25.0
    """Most that the objective of a poor match grows because it is off trusted odometry, which drives on: now
    and then a wheel slips. A larger value trusts the odometry more."""
    max_carried_surprise: float = 10.0
    """The same where odometry stands, for places that only a robot that is carried comes to. A larger value
    trusts the odometry more."""
    believed_contradictions: int = 1
    """If more successive scans than this contradict odometry, leaving it costs nothing. A larger value trusts
    the odometry longer."""
    degeneracy_poses: int = 3
    """Number of known poses from which on `degeneracy` is checked: fewer give no velocity. A larger
    number checks later."""
    degeneracy: DegeneracyOptions = DegeneracyOptions()
    """When and how far a scan keeps to its prediction in a direction of which it tells little."""
    sector_margin: float = 0.1
    """Points this near (m) to the border of what the laser had in view are not matched there: walls end. A
    larger margin matches fewer points."""
    sector_turn: float = 0.15
    """A scan that is matched farther from its prediction than this (rad) is first matched with all points:
    which of them lie in view is not known before. A larger value does so less often."""


@dataclass(frozen=True)
class TrackingOptions:
    """Step 1: every scan is matched with the local map, the NDT of the last metres of the path."""

    gaussians: GaussianOptions = field(default_factory=lambda: GaussianOptions(floor=0.03))
    """How points become the Gaussians of the local map."""
    max_range: float = 40.0
    """Longest beam that is matched, m. A larger value sees more and takes longer."""
    point_spacing: float = 0.04
    """Distance between neighbouring points of a scan that are matched, m; some are left out where they are
    closer. A larger one is faster, and blurs small things; with none a wall beside the robot outweighs all
    the rest."""
    spacing_neighbours: int = 4
    """Number of points on each side of a point between which the distance to the next one is measured. With a
    larger number the noise of ranges decides less, and small things are blurred more."""
    min_points: int = 10
    """Scans with fewer points, and than a quarter of the beams, are not matched where there is odometry: it
    tells more than these do. With a larger number odometry leads on more often."""
    bridged_gap: float = 1.0
    """Without odometry, points of the first scan of a track, or of a lost scan that joins the map, get others
    between them if they are at most this far apart, m, and if fewer than `lost_inliers` of them lie on
    Gaussians of their own: walls far away. A larger value also fills more openings between walls."""
    scan: ScanTrackingOptions = field(default_factory=ScanTrackingOptions)
    """How each scan is matched with the local map, and joins it."""
    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """The w of the energy in each stage of a match: it multiplies the information of the Gaussians, so that
    w < 1 widens them. The last w is 1. With larger ones before, matches converge only from nearer."""
    coarse_tolerance: float = 5e-3
    """With odometry, earlier stages end with a step below this, m and rad. A larger one ends them earlier."""
    restart_angles: tuple[tuple[float, ...], ...] = ((0.1, 0.2), (0.4, 0.7), (1.0, 1.3))
    """Rings of angles to start again from, to both sides, rad. A ring is tried if the one before did not
    help. More take longer."""
    lost_search: SearchOptions = field(default_factory=lambda: SearchOptions(distance=1.5, turn=1.5))
    """The search for a lost scan, around its prediction."""
    carried_search: SearchOptions = field(default_factory=lambda: SearchOptions(distance=12.0, turn=1.5))
    """The search for a scan that differs from the one before though odometry stands."""
    lost_search_path: float = 5.0
    """Length of the path among whose scans a lost scan is searched, m. A larger value takes longer."""
    clear_score: float = 0.25
    """Without odometry a lost scan is where the search finds it with at least this score, if no other place
    has nearly the same. A larger value believes the search less often."""
    clear_score_ratio: float = 0.85
    """Another place has nearly the same score if it has more than this share of it. A larger value believes
    the search more often."""
    clear_score_distance: float = 0.6
    """Places farther apart than this are different ones there, m. A larger value believes the search more
    often."""
    lost_steps: float = 2.0
    """Farthest place from the prediction where a lost scan is found, in the longest of the last steps, for
    each scan that was lost. A larger value believes the search more often."""
    lost_errors: float = 1.5
    """Standard deviation of the prediction of a lost scan, in mean errors of predictions so far. A larger
    value searches farther for loops after such scans."""
    velocity_scans: int = 5
    """Largest number of last steps whose mean is the velocity. More even out jitter of stamps, and follow
    turns later."""
    standstill_share: float = 0.9
    """Without odometry, scans that tell little are tracked from behind, too, where the robot goes less far
    than this share of its way at the highest speed after them. A larger share takes more time."""
    standstill_lag: float = 0.2
    """Least length of the missing way for this, m. A larger value keeps more scans as they are."""
    standstill_gain: float = 0.03
    """From behind these scans fit clearly better if their share of inliers is larger by this, and worse if it
    is smaller by this. A larger value leaves more to `standstill_evidence`."""
    standstill_evidence: float = 10.0
    """Where they fit neither clearly better nor worse, the motion from behind counts if the objective of the
    scans, tracked along it, is lower by this. A larger value keeps more scans as they are."""
    standstill_turn: float = 0.3
    """Where the robot turns farther than this to a scan, rad, what was found from the front counts, unless
    the scan fits clearly better from behind. A larger value believes turns from behind more often."""
    standstill_scans: int = 1024
    """Most scans without odometry that wait for one that tells its place. A larger number takes more time and
    memory in bare corridors."""
    range_limit_outliers: float = 0.001
    """Share of ranges that may exceed the range limit, as echoes. A larger one gives a shorter limit."""
    range_limit_share: float = 0.01
    """The range limit ends walls if this share of the ranges is in the last cell before it. Lasers of 12 m
    and more have 0.001 to 0.004 there, those of 6 m and less 0.02 to 0.05. With a larger share fewer lasers
    have a range limit."""
    whole_turn_beams: int = 4
    """A laser sees all around if at most this many beams are missing to a revolution. With a larger number
    fewer lasers are matched sector by sector."""
    first_scan_path: float = 5.0
    """Length of the path whose scans place the first scan of a track segment, m. A larger value is more exact
    and takes longer."""
    first_scan_max_count: int = 2_000
    """Largest number of scans that wait for that: a robot may stand for hours. A larger number takes more
    memory."""


class LaserView(NamedTuple):
    """What a laser has in view."""

    range_limit: float
    """The range at which walls end, m; infinity if they do not."""
    middle: Array
    """(3,) pose of the laser on the robot, turned to the middle of its view."""
    half_angle: float
    """Half of its angle, rad; infinity if the laser sees all around."""

    @classmethod
    def all_around(cls, range_limit: float = np.inf) -> LaserView:
        """The view of a laser that sees all around, up to the range limit (m)."""
        return cls(range_limit, np.zeros(3), np.inf)


class TrackingParameters(NamedTuple):
    """The options that kernels use, and what follows from them and from the log."""

    options: ScanTrackingOptions
    half: float
    """Side of a lattice cell of the map, m."""
    visible_range: float
    """Distance from where a scan was taken up to which it had whole cells in view, m."""
    laser: LaserView
    widenings: Array
    coarse_tolerance: float
    restart_angles: Array
    """(rings, angles), with nan where a ring has fewer."""
    is_alone: bool
    """Whether nothing but the scans tells how the robot moves: the log has no odometry."""

    @classmethod
    def of(
        cls, options: TrackingOptions, has_odometry: bool = False, laser: LaserView | None = None
    ) -> TrackingParameters:
        """The parameters for a log with or without odometry, whose laser has this view: all around by
        default."""
        laser, cell = laser or LaserView.all_around(), options.gaussians.cell
        rings = options.restart_angles
        angles = np.full((len(rings), max(map(len, rings), default=0)), np.nan)
        for row, ring in zip(angles, rings, strict=True):
            row[: len(ring)] = ring
        return cls(
            options.scan,
            half=0.5 * cell,
            visible_range=max(laser.range_limit - cell, 0.5 * laser.range_limit),
            laser=laser,
            widenings=np.array(options.widenings),
            coarse_tolerance=options.coarse_tolerance if has_odometry else options.scan.tolerance,
            restart_angles=angles,
            is_alone=not has_odometry,
        )
