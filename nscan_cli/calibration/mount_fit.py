"""Mounting of the laser and scale of odometry, from steps by scans and by odometry.

A laser mounted at m on a robot that moves by o moves by l, with o ⊕ m = m ⊕ l. With the angle ψ of the
mounting and its place t, a scale a of the odometry's positions and the turn φ of the step, that is

    o = (R(ψ) l + (I − R(φ)) t) / a

for the positions: linear in (cos ψ, sin ψ, t) / a. A. Censi, A. Franchi, L. Marchionni, G. Oriolo,
"Simultaneous Calibration of Odometry and Sensor Parameters for Mobile Robots", T-RO 2013. Their wheels are
one scale here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.robust_fit import RobustFit, median, robust_fit
from nscan_cli.poses import Array, Indices, inverse, wrap


@dataclass(frozen=True)
class TurnFit:
    """Turns by odometry as a multiple of those by scans."""

    ratio: float
    spread: float
    """Median residual as a share of the median turn."""
    steps: int
    """Number of steps with a turn."""


@dataclass(frozen=True)
class MountFit:
    """The mounting of the laser and the scale of odometry that explain the steps best."""

    scale: float
    """Metres by scans for one metre by odometry."""
    mount: Array
    """(3,) pose of the laser on the robot, m and rad."""
    covariance: Array
    """(4, 4) of scale and mounting; inf for what the steps leave open."""
    spread: float
    """Median residual as a share of the median motion."""
    tail: float
    """Upper quartile of the residuals as a share of the median motion."""
    steps: int

    @property
    def sigmas(self) -> Array:
        """(4,) standard deviations of scale, x, y and angle."""
        return np.sqrt(np.diag(self.covariance))


def fit_turns(laser: Array, odometry: Array, min_turn: float) -> TurnFit | None:
    """The ratio of turns of those steps (n, 3) that turn by `min_turn` (rad) by scans; None for few."""
    turning = np.abs(laser[:, 2]) >= min_turn
    if turning.sum() < 3:
        return None
    seen, told = laser[turning, 2], odometry[turning, 2]
    fit = robust_fit(seen[:, None, None], told[:, None])
    spread = median(fit.residuals) / median(np.abs(seen))
    return TurnFit(float(fit.values[0]), spread, int(turning.sum()))


def fit_mount(
    laser: Array,
    odometry: Array,
    metres_per_radian: float,
    groups: Indices | None = None,
    is_in_middle: bool = False,
) -> MountFit | None:
    """The fit for steps (n, 3) of laser and robot; None where there is no motion to fit.

    `groups` (g,) are the first of steps that follow each other: two have a scan in common, and its error.
    A step's motion is its length, and `metres_per_radian` times its turn. A laser that `is_in_middle` has no
    place that is open.
    """
    if len(laser) < 3:
        return None
    c, s = np.cos(laser[:, 2]), np.sin(laser[:, 2])
    rows = np.zeros((len(laser), 2, 4))
    rows[:, 0, :2] = np.stack([laser[:, 0], -laser[:, 1]], axis=1)
    rows[:, 1, :2] = np.stack([laser[:, 1], laser[:, 0]], axis=1)
    rows[:, 0, 2:] = np.stack([1.0 - c, s], axis=1)
    rows[:, 1, 2:] = np.stack([-s, 1.0 - c], axis=1)
    if is_in_middle:
        rows[:, :, 2:] = 0.0
    fit = robust_fit(rows, odometry[:, :2], groups)
    size = float(np.hypot(fit.values[0], fit.values[1]))
    if size <= 0.0:
        return None
    motion = np.hypot(laser[:, 0], laser[:, 1]) + metres_per_radian * np.abs(laser[:, 2])
    residual, tail = (np.quantile(fit.residuals, (0.5, 0.75)) / size).tolist()
    usual = median(motion)
    return MountFit(
        1.0 / size,
        np.array([fit.values[2] / size, fit.values[3] / size, np.arctan2(fit.values[1], fit.values[0])]),
        _covariance(fit, size),
        residual / usual,
        tail / usual,
        len(laser),
    )


def _covariance(fit: RobustFit, size: float) -> Array:
    """(4, 4) that of scale, x, y and angle, from that of the unknowns (cos, sin, x, y), all times `size`."""
    cos, sin, x, y = fit.values
    by_size = np.array([cos, sin, 0.0, 0.0]) / size
    jacobian = np.array([
        -by_size / size**2,
        np.array([0.0, 0.0, 1.0, 0.0]) / size - x * by_size / size**2,
        np.array([0.0, 0.0, 0.0, 1.0]) / size - y * by_size / size**2,
        np.array([-sin, cos, 0.0, 0.0]) / size**2,
    ])  # fmt: skip
    if not np.isfinite(fit.covariance).all():
        return np.full((4, 4), np.inf)
    covariance: Array = jacobian @ fit.covariance @ jacobian.T
    return covariance


def is_nearer(fit: MountFit, one: Array, other: Array, sigmas: float) -> bool:
    """Whether a fit is nearer to one mounting (3,) than to another, by so many standard deviations.

    Their places alone are compared.
    """
    apart = float(np.hypot(*(one - other)[:2]))
    if apart == 0.0:
        return False
    away, from_other = (float(np.hypot(*(fit.mount - mount)[:2])) for mount in (one, other))
    # From the line half-way between both.
    return from_other**2 - away**2 > 2.0 * apart * sigmas * float(fit.sigmas[1:3].max())


def is_nearer_in_direction(fit: MountFit, one: Array, other: Array, options: FileCheckOptions) -> bool:
    """Whether the direction of a laser is clearly that of one mounting (3,), and not that of another."""
    off, from_other = (abs(float(wrap(fit.mount[2] - mount[2]))) for mount in (one, other))
    bound = max(options.min_mount_turn, options.mount_sigmas * float(fit.sigmas[3]))
    return off <= bound < from_other - bound


def is_inverse(fit: MountFit, mount: Array, options: FileCheckOptions) -> bool:
    """Whether a fit is clearly that of the robot as the laser sees it, in place of the mounting (3,)."""
    other = inverse(mount)
    off = np.abs(fit.mount - other)
    off[2] = abs(float(wrap(off[2])))
    bounds = [options.min_mount_move, options.min_mount_move, options.min_mount_turn]
    # Of a laser that looks ahead, or back, only the sign of its place would differ.
    return (
        bool((off <= np.maximum(bounds, options.mount_sigmas * fit.sigmas[1:])).all())
        and is_nearer(fit, other, mount, options.mount_sigmas)
        and is_nearer_in_direction(fit, other, mount, options)
    )
