"""The rigid alignment of a result to its reference (S. Umeyama, PAMI 13, 1991, without scale).

Where the robot has moved, the positions decide the angle, as in the usual ATE. Where it stands, or turns on
the spot, the positions are only noise and lever arms of markers; there the headings decide the angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from nscan_cli.evaluation.options import AlignmentOptions, EvaluationOptions
from nscan_cli.poses import Array, compose


@dataclass(frozen=True)
class Alignment:
    """A rigid motion, and what decides its angle."""

    motion: Array
    """(3,)"""
    by: Literal["positions", "headings"]
    common: float
    """Common motion of result and reference, m (RMS about the mean)."""


def alignment(
    poses: Array, truth: Array, options: AlignmentOptions = EvaluationOptions.alignment
) -> Alignment:
    """The rigid motion that brings `poses` (N, 3) nearest to `truth` (N, 3).

    Least squares in closed form: with positions a and b about their means, the angle is that of Σ (a·b, a×b).
    Residuals and `position_error` make it uncertain. Where that exceeds `max_angle_sigma` and the spread of
    the headings' differences, and the robot has moved little, the angle is the mean of these differences.
    Errors of trajectories are correlated, so more poses do not reduce the uncertainty.
    """
    centre, true_centre = poses[:, :2].mean(axis=0), truth[:, :2].mean(axis=0)
    a, b = poses[:, :2] - centre, truth[:, :2] - true_centre
    dot, cross = (a * b).sum() / len(a), (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / len(a)
    common = float(np.hypot(dot, cross))
    apart = max(((a**2).sum() + (b**2).sum()) / (2 * len(a)) - common, 0.0)
    angle, heading_angle, spread = float(np.arctan2(cross, dot)), *circular_mean(truth[:, 2] - poses[:, 2])
    # Multiplied out, because common can be 0.
    least, sigma = options.position_error, max(options.max_angle_sigma, spread)
    by_heading = apart + least**2 > sigma**2 * common and common < options.driven_distance**2
    if by_heading:
        angle = heading_angle
    turned = compose([0.0, 0.0, angle], [*centre, 0.0])
    motion = np.array([*(true_centre - turned[:2]), angle])
    return Alignment(motion, "headings" if by_heading else "positions", common**0.5)


def circular_mean(angles: Array) -> tuple[float, float]:
    """The mean direction of angles (N,), and their circular standard deviation, rad."""
    cos, sin = float(np.cos(angles).mean()), float(np.sin(angles).mean())
    length = min(np.hypot(cos, sin), 1.0)
    spread = float(np.sqrt(-2 * np.log(length))) if length > 0 else np.inf
    return float(np.arctan2(sin, cos)), spread
