"""What an ordinary drive says about the robot: mounting, odometry and clocks, each with a standard deviation.

The mounting and the scale follow in closed form from the steps (mount_fit.py). The lag of the clocks, the
ratio of the turns and the heading that is gained per metre are fitted to the turns, the lag by Gauss-Newton
steps. Both fits are robust against slips.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.measured_steps import MeasuredSteps, measure_steps
from nscan_cli.calibration.mount_fit import MountFit, fit_mount
from nscan_cli.calibration.odometry_clock import clock_lag
from nscan_cli.calibration.options import CalibrationOptions
from nscan_cli.calibration.robust_fit import TO_SIGMA, robust_fit
from nscan_cli.calibration.step_sampling import successive_steps
from nscan_cli.errors import InputDataError
from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import MIRRORED, Array, are_known, compose, inverse, relative, wrap


@dataclass(frozen=True)
class Estimate:
    """A value by the scans."""

    value: float
    sigma: float
    """Standard deviation; inf where the drive leaves the value open."""
    recorded: float | None = None
    """The value that the file, or an option, says; None if they say nothing."""


NO_TURNS = Estimate(1.0, np.inf, 1.0), Estimate(0.0, np.inf, 0.0), Estimate(0.0, np.inf, 0.0)
"""Ratio of the turns, heading gained per metre and offset of the clocks, where turns do not tell."""


@dataclass(frozen=True)
class Evidence:
    """The steps that a calibration rests on."""

    sampled: int
    measured: int
    """Steps that the scans measure beyond doubt and that odometry has."""
    turns: int
    """Those that turn."""
    distance: float
    """m, of the measured steps."""
    turned: float
    """rad, of the measured steps."""


@dataclass(frozen=True)
class Calibration:
    """The robot as its scans and its odometry agree best. Lengths in m, angles in rad, times in s."""

    mirrored: bool
    """Whether the readings are in the wrong order."""
    values: dict[str, Estimate]
    """mount_x, mount_y, mount_angle; odometry_scale, turn_ratio (turns by odometry as a multiple of those by
    scans), veer (heading that odometry gains per metre); clock_offset; noise_distance (per metre) and
    noise_turn (per radian) of steps by odometry."""
    evidence: Evidence

    @property
    def open(self) -> list[str]:
        """The values that the drive leaves open."""
        return [name for name, estimate in self.values.items() if not np.isfinite(estimate.sigma)]


def calibrate(log: LaserLog, reading: ReadingOptions, options: CalibrationOptions) -> Calibration:
    """Calibrate the robot of a log that was read with these options.

    Raises InputDataError if it has no odometry, or its scans tell too little.
    """
    if log.odometry is None:
        raise InputDataError(log.source.name, "has no odometry to calibrate", "give a log that has it")
    rows = successive_steps(log, options.steps)
    steps = measure_steps(log, rows, options.steps)
    drive = _Drive(log, steps, options)
    if drive.moving.sum() < options.min_steps:
        measured = counted(int(drive.moving.sum()), "step")
        problem = f"its scans measure the motion of {measured} only, of {len(rows[0])}"
        raise InputDataError(log.source.name, problem, "give a longer drive, along more than bare walls")
    lag, mirrored = drive.clock()
    ratio, veer, offset = drive.turn_fit(lag, mirrored)
    fit, scale = drive.mount_fit(offset.value, mirrored), reading.odometry_scale
    if fit is None:
        raise InputDataError(log.source.name, "its odometry never moves", "give a log whose odometry does")
    return Calibration(
        mirrored,
        {
            **_mounting(fit, log.mount, np.isfinite(ratio.sigma)),
            "odometry_scale": Estimate(scale * fit.scale, scale * float(fit.sigmas[0]), scale),
            "turn_ratio": ratio,
            "veer": veer,
            "clock_offset": replace(
                offset, value=reading.clock_offset + offset.value, recorded=reading.clock_offset
            ),
            **drive.noise(offset.value, fit, ratio.value, veer.value, mirrored),
        },
        drive.evidence(len(rows[0])),
    )


def _mounting(fit: MountFit, mount: Array, turns_agree: bool) -> dict[str, Estimate]:
    _, x, y, angle = fit.sigmas.tolist()
    x, y = (x, y) if turns_agree else (np.inf, np.inf)
    turned = float(mount[2] + wrap(fit.mount[2] - mount[2]))
    return {
        "mount_x": Estimate(float(fit.mount[0]), x, float(mount[0])),
        "mount_y": Estimate(float(fit.mount[1]), y, float(mount[1])),
        "mount_angle": Estimate(turned, angle, float(mount[2])),
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
        self.steps = MeasuredSteps(
            steps.first[has_odometry], steps.last[has_odometry],
            steps.laser[has_odometry], steps.covariances[has_odometry],
        )  # fmt: skip
        self.laser = self.steps.laser
        self._begins, self._ends = log.times[self.steps.first], log.times[self.steps.last]
        length, least = np.hypot(self.laser[:, 0], self.laser[:, 1]), options.steps.min_motion
        self.length, self.turning = length, np.abs(self.laser[:, 2]) >= least
        self.moving = (length >= least) | self.turning

    @property
    def turns_enough(self) -> bool:
        """Whether there are steps with a turn enough."""
        return bool(self.turning.sum() >= self.options.min_turns)

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

    def clock(self) -> tuple[float | None, bool]:
        """The offset of the clocks to begin with, s, None if turns do not tell; whether they are mirrored."""
        if not self.turns_enough:
            return None, False
        options, gain = self.options.clock, self.options.clock.gain
        lag, other = (clock_lag(self.log, self.steps, options, sign) for sign in (1.0, -1.0))
        assert lag is not None
        assert other is not None
        mirrored = other.disagreement < gain * lag.disagreement
        best = other if mirrored else lag
        return (best.offset if best.disagreement < gain * best.elsewhere else None), mirrored

    def turn_fit(self, lag: float | None, mirrored: bool) -> tuple[Estimate, Estimate, Estimate]:
        """Ratio of the turns, heading gained per metre (rad/m), and offset of the clocks (s), near `lag`."""
        if not self.turns_enough:
            return NO_TURNS
        used, offset = self.moving, lag or 0.0
        turns = self.laser[used, 2] * (-1.0 if mirrored else 1.0)
        # Of a drive that is mostly straight, the turns would else be outliers.
        expected = self.options.angle_sigma + self.options.angle_sigma_per_radian * np.abs(turns)
        for _ in range(self.options.clock_iterations):
            told = self.odometry(offset)[used, 2]
            # A later clock of odometry tells at a time what was before.
            by_lag = self._turn_rates(self._ends[used] - offset) - self._turn_rates(
                self._begins[used] - offset
            )
            columns = [turns, self.length[used], *([] if lag is None else [by_lag])]
            rows = np.stack(columns, axis=1) / expected[:, None]
            fit = robust_fit(rows[:, None, :], (told / expected)[:, None])
            if lag is not None:
                # Rates hold near their time only.
                limit = self.options.clock.resolution
                offset += float(np.clip(fit.values[2], -limit, limit))
        sigmas = np.sqrt(np.diag(fit.covariance))
        left = np.median((fit.residuals * expected)[self.turning[used]])
        if left > self.options.max_turn_spread * np.median(np.abs(turns[self.turning[used]])):
            return NO_TURNS
        return (
            Estimate(float(fit.values[0]), float(sigmas[0]), 1.0),
            Estimate(float(fit.values[1]), float(sigmas[1]), 0.0),
            Estimate(offset, np.inf if lag is None else float(sigmas[2]), 0.0),
        )

    def mount_fit(self, offset: float, mirrored: bool) -> MountFit | None:
        laser = self.laser[self.moving] * (MIRRORED if mirrored else 1.0)
        return fit_mount(laser, self.odometry(offset)[self.moving], self.options.steps.metres_per_radian)

    def noise(
        self, offset: float, fit: MountFit, ratio: float, veer: float, mirrored: bool
    ) -> dict[str, Estimate]:
        """Standard deviations of calibrated odometry: of a step's length per metre, of its turn per radian.

        What the matches account for is taken out. The laser's steps are compared as those of the robot that
        carries it at the fitted mounting.
        """
        laser = self.laser * (MIRRORED if mirrored else 1.0)
        robot = compose(compose(fit.mount, laser), inverse(fit.mount))
        told, came = self.odometry(offset), np.hypot(robot[:, 0], robot[:, 1])
        far = came >= self.options.steps.min_motion
        along = (np.hypot(told[:, 0], told[:, 1]) * fit.scale - came)[far]
        turns = laser[:, 2]
        about = (told[:, 2] - ratio * turns - veer * came)[self.turning]
        by_match = np.sqrt(np.median(self.steps.covariances[:, [0, 2], [0, 2]], axis=0))
        return {
            "noise_distance": _noise(along, came[far], float(by_match[0])),
            "noise_turn": _noise(about, np.abs(turns[self.turning]), float(by_match[1])),
        }

    def evidence(self, sampled: int) -> Evidence:
        return Evidence(
            sampled,
            len(self.laser),
            int(self.turning.sum()),
            float(self.length.sum()),
            float(np.abs(self.laser[:, 2]).sum()),
        )


def _noise(residuals: Array, motion: Array, by_match: float) -> Estimate:
    """The standard deviation of residuals (n,) per unit of motion (n,), without that of the matches."""
    if len(residuals) < 3:
        return Estimate(0.0, np.inf)
    sigma = TO_SIGMA * float(np.median(np.abs(residuals - np.median(residuals))))
    own = np.sqrt(max(sigma**2 - by_match**2, 0.0)) / float(np.median(motion))
    return Estimate(own, sigma / float(np.median(motion)) / np.sqrt(2 * len(residuals)))
