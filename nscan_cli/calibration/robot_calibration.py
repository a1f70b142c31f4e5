"""What an ordinary drive says about the robot: laser, odometry and clocks, each with a standard deviation.

The mounting and the scale follow in closed form from the steps (mount_fit.py), the offset of the clocks from
their turns by Gauss-Newton steps, the ratio of the turns and the heading that is gained per metre from the
turns of chains of steps. All fits are robust against slips.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.clock_offset import clock_offset
from nscan_cli.calibration.estimate import Estimate, estimate, left_open
from nscan_cli.calibration.measured_steps import MeasuredSteps, measure_steps
from nscan_cli.calibration.mount_fit import MountFit, fit_mount
from nscan_cli.calibration.options import CalibrationOptions
from nscan_cli.calibration.robust_fit import TO_SIGMA, robust_fit
from nscan_cli.calibration.step_sampling import successive_steps
from nscan_cli.calibration.sweep_calibration import calibrated_sweep
from nscan_cli.calibration.wheels import sideways_share, wheels
from nscan_cli.errors import InputDataError
from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import MIRRORED, Array, are_known, compose, inverse, relative, wrap

HARDLY_TURNS = "the robot hardly turns"
TURNS_DIFFER = "turns by odometry and by scans have too little in common"
NO_OFFSET = "turns agree at no offset of the clocks better than at others"
FEW_STEPS = "too few steps go far enough"
STEPS_ALIKE = "all steps are alike"


@dataclass(frozen=True)
class CalibrationEvidence:
    """The steps that a calibration rests on."""

    sampled: int
    measured: int
    """Steps that the scans measure beyond doubt and that odometry has."""
    turns: int
    """Measured steps with a turn."""
    distance: float
    """Length of the measured steps, m."""
    turned: float
    """Sum of the turns of the measured steps, rad."""
    pairs: int
    """Pairs of scans that the time of the laser's sweep rests on."""


@dataclass(frozen=True)
class Calibration:
    """The robot as its scans and its odometry agree best. Lengths in m, angles in rad, times in s."""

    mirrored: bool
    """Whether the readings are in the wrong order."""
    values: dict[str, Estimate]
    """sweep_time; mount_x, mount_y, mount_angle; odometry_scale, turn_ratio (turns by odometry as a multiple
    of those by scans), veer (heading that odometry gains per metre); wheel_difference and track_width
    (wheels.py); clock_offset; noise_distance (per metre) and noise_turn (per radian) of steps by odometry."""
    evidence: CalibrationEvidence
    sweep: float
    """The time of the laser's sweep that the steps were measured with, s; negative if the readings are in the
    reverse order of time, 0 if all are seen at once."""
    stamp: str | None
    """Beam at whose time scans are stamped: first, middle or last; None where nothing tells it."""

    @property
    def open(self) -> list[str]:
        """The values that the drive leaves open."""
        return [name for name, value in self.values.items() if value.is_open]


def calibrate(log: LaserLog, reading: ReadingOptions, options: CalibrationOptions) -> Calibration:
    """Calibrate the robot of a log that was read with these options.

    Raises InputDataError if it has no odometry, or its scans tell too little.
    """
    if log.odometry is None:
        why = [text for text in log.report.notices() if "odometry" in text or "clock" in text]
        remedy = "; ".join(why) or "give a log that has it"
        raise InputDataError(log.source.name, "has no odometry to calibrate", remedy)
    sweep = calibrated_sweep(log, options)
    # What a scan tells is where the robot is at its middle beam.
    log = sweep.log.at_middle_of_sweeps()
    rows = successive_steps(log, options.steps)
    steps = measure_steps(log, rows, options.steps, sweep.corrected if sweep.seconds else None)
    drive = _Drive(log, steps, options)
    if drive.moving.sum() < options.min_steps:
        measured = counted(int(drive.moving.sum()), "step")
        problem = f"its scans measure the motion of {measured} only, of {len(rows[0])}"
        raise InputDataError(log.source.name, problem, "give a longer drive, along more than bare walls")
    offset, mirrored, why_open = drive.clock()
    fit, scale = drive.mount_fit(offset.value, mirrored), reading.odometry_scale
    if fit is None:
        raise InputDataError(log.source.name, "its odometry never moves", "give a log whose odometry does")
    ratio, veer = drive.turn_fit(offset.value, fit.scale, mirrored, why_open)
    by_scale = estimate(scale * fit.scale, scale * float(fit.sigmas[0]), scale, STEPS_ALIKE)
    sideways = sideways_share(drive.odometry(offset.value)[drive.moving])
    return Calibration(
        mirrored,
        {
            "sweep_time": sweep.estimate,
            **_mounting(fit, log.mount, why_open),
            "odometry_scale": by_scale,
            "turn_ratio": ratio,
            "veer": veer,
            **wheels(by_scale, ratio, veer, sideways, options.max_sideways),
            "clock_offset": replace(
                offset, value=reading.clock_offset + offset.value, recorded=reading.clock_offset
            ),
            **drive.noise(offset.value, fit, ratio.value, veer.value, mirrored),
        },
        CalibrationEvidence(
            len(rows[0]),
            len(drive.laser),
            int(drive.turning.sum()),
            float(drive.length.sum()),
            float(np.abs(drive.laser[:, 2]).sum()),
            sweep.pairs,
        ),
        sweep.seconds,
        sweep.stamp(reading.stamp, offset),
    )


def _mounting(fit: MountFit, mount: Array, why_open: str) -> dict[str, Estimate]:
    """`why_open`: why the place stays open, empty if it does not."""
    _, *sigmas, angle = fit.sigmas.tolist()
    x, y = (np.inf, np.inf) if why_open else sigmas
    why_open = why_open or STEPS_ALIKE
    turned = float(mount[2] + wrap(fit.mount[2] - mount[2]))
    return {
        "mount_x": estimate(float(fit.mount[0]), x, float(mount[0]), why_open),
        "mount_y": estimate(float(fit.mount[1]), y, float(mount[1]), why_open),
        "mount_angle": estimate(turned, angle, float(mount[2]), STEPS_ALIKE),
    }


class _Drive:
    """The measured steps of a log whose odometry can be shifted in time."""

    def __init__(self, log: LaserLog, steps: MeasuredSteps, options: CalibrationOptions) -> None:
        assert log.odometry is not None
        self.log, self.options = log, options
        known = are_known(log.odometry)
        self._at, self._poses = log.times[known], log.odometry[known].copy()
        self._poses[:, 2] = np.unwrap(self._poses[:, 2])
        has_odometry = known[steps.first] & known[steps.last]
        self.steps = steps.of(has_odometry)
        self.laser = self.steps.laser
        self._begins, self._ends = log.times[self.steps.first], log.times[self.steps.last]
        length, least = np.hypot(self.laser[:, 0], self.laser[:, 1]), options.steps.min_motion
        self.length, self.turning = length, np.abs(self.laser[:, 2]) >= least
        self.moving = (length >= least) | self.turning

    def odometry(self, offset: float) -> Array:
        """(n, 3) the steps by odometry whose clock is shifted by an offset (s)."""
        return relative(self._poses_at(self._ends - offset), self._poses_at(self._begins - offset))

    def _poses_at(self, times: Array) -> Array:
        return np.stack([np.interp(times, self._at, column) for column in self._poses.T], axis=1)

    def _turn_rates(self, times: Array) -> Array:
        """(n,) rad/s at times (n,), over a scan period to each side."""
        half = max(float(np.median(np.diff(self._at))), 1e-3)
        after, before = (np.interp(times + side, self._at, self._poses[:, 2]) for side in (half, -half))
        return (after - before) / (2 * half)

    def clock(self) -> tuple[Estimate, bool, str]:
        """The offset of the clocks, s; whether readings are mirrored; why turns do not tell, or nothing."""
        if self.turning.sum() < self.options.min_turns:
            return left_open(0.0, 0.0, HARDLY_TURNS), False, HARDLY_TURNS
        options, gain = self.options.clock, self.options.clock.gain
        plain, other = (clock_offset(self.log, self.steps, options, sign) for sign in (1.0, -1.0))
        assert plain is not None
        assert other is not None
        mirrored = other.disagreement < gain * plain.disagreement
        best = other if mirrored else plain
        is_told = best.disagreement < gain * best.elsewhere
        offset, left = self._clock_fit(best.offset if is_told else 0.0, mirrored)
        if left > self.options.max_turn_spread:
            return left_open(0.0, 0.0, TURNS_DIFFER), mirrored, TURNS_DIFFER
        return offset if is_told else left_open(0.0, 0.0, NO_OFFSET), mirrored, ""

    def _clock_fit(self, offset: float, mirrored: bool) -> tuple[Estimate, float]:
        """The offset of the clocks, s, near another, and what is then left of turns, as a share of them."""
        used = self.moving
        turns = self.laser[used, 2] * (-1.0 if mirrored else 1.0)
        # Of a drive that is mostly straight, the turns would else be outliers.
        expected = self.options.angle_sigma + self.options.angle_sigma_per_radian * np.abs(turns)
        for _ in range(self.options.clock_iterations):
            told = self.odometry(offset)[used, 2]
            # A later clock of odometry tells at a time what was before.
            by_offset = self._turn_rates(self._ends[used] - offset) - self._turn_rates(
                self._begins[used] - offset
            )
            rows = np.stack([turns, self.length[used], by_offset], axis=1) / expected[:, None]
            fit = robust_fit(rows[:, None, :], (told / expected)[:, None])
            # Rates hold near their time only.
            limit = self.options.clock.resolution
            offset += float(np.clip(fit.values[2], -limit, limit))
        left = np.median((fit.residuals * expected)[self.turning[used]])
        sigma = float(np.sqrt(fit.covariance[2, 2]))
        return Estimate(offset, sigma, 0.0), float(left / np.median(np.abs(turns[self.turning[used]])))

    def turn_fit(
        self, offset: float, scale: float, mirrored: bool, why_open: str
    ) -> tuple[Estimate, Estimate]:
        """Ratio of the turns, and heading gained per metre (rad/m), by chains of steps.

        `why_open`: why turns do not tell, empty if they do.
        """
        if why_open:
            return left_open(1.0, 1.0, why_open), left_open(0.0, 0.0, why_open)
        begins = self.steps.chains(self.options.steps.chain)
        told = self.odometry(offset)
        columns = self.laser[:, 2] * (-1.0 if mirrored else 1.0), _forward(told, scale), told[:, 2]
        turned, driven, by_odometry = (np.add.reduceat(column, begins) for column in columns)
        # Errors of steps add up as in a random walk.
        expected = np.sqrt(np.diff(np.append(begins, len(told))))
        rows = np.stack([turned, driven], axis=1) / expected[:, None]
        fit = robust_fit(rows[:, None, :], (by_odometry / expected)[:, None])
        ratio, veer = fit.values.tolist()
        sigmas = np.sqrt(np.diag(fit.covariance)).tolist()
        return estimate(ratio, sigmas[0], 1.0, FEW_STEPS), estimate(veer, sigmas[1], 0.0, FEW_STEPS)

    def mount_fit(self, offset: float, mirrored: bool) -> MountFit | None:
        laser, told = self.laser[self.moving] * (MIRRORED if mirrored else 1.0), self.odometry(offset)
        group = np.searchsorted(
            self.steps.chains(self.options.dependent_steps), np.flatnonzero(self.moving), side="right"
        )
        groups = np.flatnonzero(np.diff(group, prepend=0))
        return fit_mount(laser, told[self.moving], self.options.steps.metres_per_radian, groups)

    def noise(
        self, offset: float, fit: MountFit, ratio: float, veer: float, mirrored: bool
    ) -> dict[str, Estimate]:
        """Standard deviations of calibrated odometry: of a step's length per metre, of its turn per radian.

        The part that the matches account for is subtracted. The laser's steps are first turned into steps of
        the robot, by the fitted mounting.
        """
        laser = self.laser * (MIRRORED if mirrored else 1.0)
        robot = compose(compose(fit.mount, laser), inverse(fit.mount))
        told, came = self.odometry(offset), np.hypot(robot[:, 0], robot[:, 1])
        far = came >= self.options.steps.min_motion
        along = (np.hypot(told[:, 0], told[:, 1]) * fit.scale - came)[far]
        turns = laser[:, 2]
        about = (told[:, 2] - ratio * turns - veer * _forward(told, fit.scale))[self.turning]
        by_match = np.sqrt(np.median(self.steps.covariances[:, [0, 2], [0, 2]], axis=0))
        return {
            "noise_distance": _noise(along, came[far], float(by_match[0])),
            "noise_turn": _noise(about, np.abs(turns[self.turning]), float(by_match[1])),
        }


def _forward(odometry: Array, scale: float) -> Array:
    """(n,) way of steps (n, 3) by odometry, m by scans; negative where the robot drives backwards."""
    return scale * np.copysign(np.hypot(odometry[:, 0], odometry[:, 1]), odometry[:, 0])


def _noise(residuals: Array, motion: Array, by_match: float) -> Estimate:
    """The standard deviation of residuals (n,) per unit of motion (n,), without that of the matches."""
    if len(residuals) < 3:
        return left_open(0.0, None, FEW_STEPS)
    sigma = TO_SIGMA * float(np.median(np.abs(residuals - np.median(residuals))))
    own = np.sqrt(max(sigma**2 - by_match**2, 0.0)) / float(np.median(motion))
    return Estimate(own, sigma / float(np.median(motion)) / np.sqrt(2 * len(residuals)))
