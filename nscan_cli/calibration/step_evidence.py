"""The steps of a log by scans and by odometry: what mounting, scale and signs explain them."""

from __future__ import annotations

import functools
import math

import numpy as np

from nscan_cli.calibration.measured_steps import MeasuredSteps
from nscan_cli.calibration.mount_fit import MountFit, TurnFit, fit_mount, fit_turns
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.robust_fit import median
from nscan_cli.calibration.scale_change import ScaleChange, scale_change
from nscan_cli.calibration.view_change import DirectionChange, TurnChange, direction_change, turn_change
from nscan_cli.logs.expected_sizes import ranges_over_odometry
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import MIRRORED, Array, Mask, are_known, relative, transform, wrap


class StepEvidence:
    """The steps by scans and by odometry, of those that have both."""

    def __init__(
        self, log: LaserLog, odometry: Array, steps: MeasuredSteps, options: FileCheckOptions
    ) -> None:
        """`odometry` (S, 3) are the poses of all scans."""
        self._log = log
        by_odometry = steps.odometry(odometry)
        self.steps, self.options, self.poses = steps, options, odometry
        known = are_known(by_odometry)
        self.both, self.odometry = steps.of(known), by_odometry[known]
        self._tells_place = self.both.tell_places(options.steps)
        # What is not told has no length.
        self.laser = np.where(self._tells_place[:, None], self.both.laser, self.both.laser * (0.0, 0.0, 1.0))
        least = options.steps.min_motion
        self._is_turning = np.abs(self.laser[:, 2]) >= least
        self._is_moving = _moves(self.laser, least) & self._tells_place
        driven = self._is_driven()
        if 2 * int((driven & ~self._is_moving).sum()) > int(driven.sum()):
            # In ranges that are much too short all motion is small, and in proportion.
            arm = options.steps.metres_per_radian
            if explains_positions(fit_mount(self.laser[driven], self.odometry[driven], arm), options):
                self._is_moving |= driven

    @property
    def moving(self) -> int:
        """The number of steps with motion by scans."""
        return int(self._is_moving.sum())

    @property
    def turning(self) -> int:
        """The number of steps with a turn by scans."""
        return int(self._is_turning.sum())

    @property
    def turning_both(self) -> int:
        """The number of steps with a turn by scans in which odometry turns, too."""
        seen, told = (np.abs(steps[self._is_turning, 2]) for steps in (self.laser, self.odometry))
        return int((told >= self.options.min_turn_share * seen).sum())

    @property
    def unchanged(self) -> tuple[int, int]:
        """The number of steps without motion by scans, and of all, among those that are clearly some by
        odometry."""
        driven = self._is_driven()
        return int((driven & ~self._is_moving).sum()), int(driven.sum())

    @property
    def opposite_share(self) -> float:
        """The share of the steps with a turn by scans whose turn by odometry is opposite; 0 for none."""
        turns = self.laser[self._is_turning, 2] * self.odometry[self._is_turning, 2]
        return float((turns < 0.0).mean()) if len(turns) else 0.0

    @property
    def unlike_turns(self) -> tuple[int, float]:
        """The number of steps with a turn by scans or by odometry, and the median difference of both turns,
        as a share of the larger one; 0 for none. They may be opposite."""
        seen, told = np.abs(self.laser[:, 2]), np.abs(self.odometry[:, 2])
        larger = np.maximum(seen, told)
        turning = larger >= self.options.steps.min_motion
        off = np.abs(seen - told)[turning] / larger[turning]
        return len(off), median(off) if len(off) else 0.0

    @property
    def disagreement(self) -> float:
        """The sum of the differences of turns by scans and by odometry, as a share of all turns by scans.

        That of mirrored scans if it is less.
        """
        most, turns = self.options.clock.max_difference, self.laser[:, 2]
        whole = float(np.minimum(np.abs(turns), most).sum())
        off = [np.minimum(np.abs(wrap(self.odometry[:, 2] - seen)), most).sum() for seen in (turns, -turns)]
        return float(min(off)) / whole if whole > 0.0 else 0.0

    @property
    def forward_share(self) -> float:
        """The share of the steps with motion that go forward by odometry."""
        return float((self.odometry[self._is_moving, 0] > 0.0).mean())

    @property
    def tells_enough(self) -> bool:
        """Whether there is nothing that more steps would tell."""
        return self.turning >= self.options.min_steps and self.moving >= self.options.min_steps_to_exclude

    @functools.cached_property
    def turns(self) -> TurnFit | None:
        """Turns by odometry as a multiple of those by scans; None for few."""
        return fit_turns(self.laser, self.odometry, self.options.steps.min_motion)

    @functools.cached_property
    def fit(self) -> MountFit | None:
        """The mounting and the scale that explain the steps with motion."""
        return self._fit(self.laser, self.odometry)

    @functools.cached_property
    def mirrored_fit(self) -> MountFit | None:
        """The mounting and the scale that explain the steps of mirrored scans."""
        return self._fit(self.laser * MIRRORED, self.odometry)

    @functools.cached_property
    def is_explained_without_place(self) -> bool:
        """Whether a direction of the laser and a scale explain most of the steps with motion.

        Matches that failed and turn where the robot does not would have the laser anywhere.
        """
        fits = [
            self._fit(laser, self.odometry, is_in_middle=True)
            for laser in (self.laser, self.laser * MIRRORED)
        ]
        return any(fit is not None and fit.spread <= self.options.max_spread for fit in fits)

    @functools.cached_property
    def change(self) -> ScaleChange | None:
        """The clearest change of scale along the steps."""
        if self.fit is None:
            return None
        sigmas = length_sigmas(self.laser, self.both.covariances)
        return scale_change(self.laser, self.odometry, sigmas, self.fit, self.options.change)

    def ranges_over_odometry(self, scale: float) -> float:
        """How much likelier, as a factor, the ranges are to be wrong than odometry, if one metre by odometry
        is `scale` (m) by scans."""
        moving, ends = self._is_moving, (self.both.first, self.both.last)
        lasted = (self._log.times[ends[1]] - self._log.times[ends[0]])[moving]
        speed = float(np.median(np.hypot(*self.odometry[moving, :2].T) / lasted))
        seen = self._log.ranges[ends[0]]
        usual = float(np.median(seen[np.isfinite(seen)]))
        return ranges_over_odometry(usual, speed, 1.0 / scale, self.options.expected) if speed > 0.0 else 0.0

    def turn_change(self, least: int) -> TurnChange | None:
        """The clearest change of the signs of turns, with at least so many turns before and behind."""
        return turn_change(self.laser, self.odometry, least, self.options.view)

    def direction_change(self, mount: Array, least: int) -> DirectionChange | None:
        """The clearest change of the direction of a laser, mounted at (3,), with so many steps on both
        sides."""
        return direction_change(self.laser, self.odometry, mount, least, self.options.view)

    def fit_without(self, change: ScaleChange) -> MountFit | None:
        """The fit of odometry whose scale does not change."""
        odometry = self.odometry.copy()
        odometry[change.step :, :2] *= change.behind / change.before
        return self._fit(self.laser, odometry)

    def fit_turned(self, change: DirectionChange) -> MountFit | None:
        """The fit of a laser that looks where it does before a change."""
        laser, turn = self.laser.copy(), change.behind - change.before
        behind = slice(change.step, change.end)
        laser[behind, :2] = transform(np.array([0.0, 0.0, turn]), laser[behind, :2])
        return self._fit(laser, self.odometry)

    def fit_with_signs(self, signs: Array) -> MountFit | None:
        """The fit of odometry whose coordinates are multiplied by signs (3,)."""
        return self._fit(self.laser, self.both.odometry(self.poses * signs))

    def _is_driven(self) -> Mask:
        """(n,) which steps that tell places go clearly by odometry."""
        return _moves(self.odometry, self.options.min_driven) & self._tells_place

    def _fit(self, laser: Array, odometry: Array, is_in_middle: bool = False) -> MountFit | None:
        moving, arm = self._is_moving, self.options.steps.metres_per_radian
        return fit_mount(laser[moving], odometry[moving], arm, is_in_middle=is_in_middle)


def _moves(steps: Array, least: float) -> Mask:
    """(n,) which steps (n, 3) go so far (m) or turn so much (rad)."""
    return (np.hypot(steps[:, 0], steps[:, 1]) >= least) | (np.abs(steps[:, 2]) >= least)


def length_sigmas(laser: Array, covariances: Array) -> Array:
    """(n,) standard deviations of the lengths of steps (n, 3) with covariances (n, 3, 3), m."""
    lengths = np.hypot(laser[:, 0], laser[:, 1])
    along = laser[:, :2] / np.maximum(lengths, np.finfo(float).tiny)[:, None]
    sigmas: Array = np.sqrt(np.einsum("ni,nij,nj->n", along, covariances[:, :2, :2], along))
    return sigmas


def never_changes(odometry: Array, still: float) -> Mask:
    """(3,) which coordinates of the robot in poses (S, 3) stay within `still` (m, rad), seen from the first
    one."""
    known = odometry[are_known(odometry)]
    moves = np.abs(relative(known, known[0])).max(axis=0)
    never: Mask = moves < still
    return never


def explains_positions(fit: MountFit | None, options: FileCheckOptions) -> bool:
    """Whether a mounting and a scale explain the positions."""
    return fit is not None and fit.spread <= options.max_spread and fit.tail <= options.max_tail


def agrees_clearly(evidence: StepEvidence, mount: Array, options: FileCheckOptions) -> bool:
    """Whether steps agree so well with odometry and the mounting (3,) that more would contradict neither.

    Whatever would be named is farther off than `clear_sigmas`, and residuals are at most `clear_share` of
    what they may be.
    """
    if min(evidence.turning, evidence.moving) < options.min_clear_steps:
        return False
    turns, fit, share = evidence.turns, evidence.fit, options.clear_share
    if turns is None or fit is None:
        return False
    if evidence.change is None or is_change(evidence.change, options, options.change.doubt_sigmas):
        return False
    if is_view_in_doubt(evidence, mount, options):
        return False
    if max(turns.spread, fit.spread) > share * options.max_spread or fit.tail > share * options.max_tail:
        return False
    off = fit.mount - mount
    errors = np.abs([np.log(fit.scale), off[0], off[1], wrap(off[2])])
    errors += options.clear_sigmas * fit.sigmas / [fit.scale, 1.0, 1.0, 1.0]
    bounds = [np.log(options.min_scale_factor), *[options.min_mount_move] * 2, options.min_mount_turn]
    return bool((errors <= bounds).all()) and abs(turns.ratio - 1.0) <= share * options.max_turn_error


def is_change(change: ScaleChange | None, options: FileCheckOptions, sigmas: float) -> bool:
    """Whether the scale changes along the steps, by so many standard deviations."""
    return change is not None and change.exceeds(options.change.min_factor, sigmas)


def is_view_in_doubt(evidence: StepEvidence, mount: Array, options: FileCheckOptions) -> bool:
    """Whether the laser, mounted at (3,), may be turned, or its readings reversed, from a scan on."""
    view = options.view
    turned = evidence.direction_change(mount, view.doubt_steps)
    mirrored = evidence.turn_change(view.doubt_steps)
    is_turned = turned is not None and turned.exceeds(view.min_direction, view.doubt_sigmas)
    return is_turned or (mirrored is not None and mirrored.is_order)


def is_wrong_scale(fit: MountFit, options: FileCheckOptions) -> bool:
    """Whether odometry and scans count lengths in different units."""
    off, sigma = abs(math.log(fit.scale)), float(fit.sigmas[0]) / fit.scale
    return off > max(math.log(options.min_scale_factor), options.mount_sigmas * sigma)


def is_excluded(fit: MountFit | None, options: FileCheckOptions) -> bool:
    """Whether no mounting and no scale comes near to explaining the positions."""
    return (
        fit is not None and fit.steps >= options.min_steps_to_exclude and fit.spread > options.excluded_spread
    )


def turns_agree(turns: TurnFit, options: FileCheckOptions) -> bool:
    """Whether turns by odometry and by scans are of the same size; they may be opposite."""
    return turns.spread <= options.max_spread and are_of_one_size(turns, options)


def are_of_one_size(turns: TurnFit, options: FileCheckOptions) -> bool:
    """Whether turns by odometry and by scans are of the same size in the mean; they may be opposite."""
    return abs(abs(turns.ratio) - 1.0) <= options.max_turn_error
