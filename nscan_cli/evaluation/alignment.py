"""The motion that takes a result into the frame of its reference, and what decides its angle.

Where the robot has moved, the positions do: that is the ATE as others have it. Of a robot that stands, or
turns where it is, the positions are noise and the lever arms of markers, and any angle fits them; there the
headings decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from nscan_cli.poses import Array, compose, wrap

ACCURACY = 0.02
"""m by which positions are off at least: where markers sit, nobody knows better."""
OPEN = 0.2
"""rad; where the positions know the angle no better, it is open."""
DRIVE = 0.3
"""m (RMS about the mean) that both have moved together: beyond, they have driven, whatever the result."""


@dataclass(frozen=True)
class Alignment:
    """A rigid motion, and what its angle is from."""

    motion: Array
    """(3,)"""
    by: Literal["positions", "headings"]
    common: float
    """m (RMS about the mean) that result and reference have moved together."""


def alignment(poses: Array, truth: Array) -> Alignment:
    """The rigid motion that brings `poses` (N, 3) nearest to `truth` (N, 3).

    Least squares in closed form: with positions from their means, a and b, the angle is that of
    Σ (a·b, a×b). What a and b have not in common, and ACCURACY, leave it uncertain: where by more than OPEN,
    and the headings know it better, it is the mean of what these differ by. Errors of trajectories go
    together, and so neither becomes surer by more poses.
    """
    centre, true_centre = poses[:, :2].mean(axis=0), truth[:, :2].mean(axis=0)
    a, b = poses[:, :2] - centre, truth[:, :2] - true_centre
    dot, cross = (a * b).sum() / len(a), (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / len(a)
    common = float(np.hypot(dot, cross))
    apart = max(((a**2).sum() + (b**2).sum()) / (2 * len(a)) - common, 0.0)
    angle, by_headings, spread = float(np.arctan2(cross, dot)), *_mean_angle(truth[:, 2] - poses[:, 2])
    # As long as common is small: it can be 0.
    is_open = apart + ACCURACY**2 > max(OPEN, spread) ** 2 * common and common < DRIVE**2
    if is_open:
        angle = by_headings
    turned = compose([0.0, 0.0, angle], [*centre, 0.0])
    motion = np.array([*(true_centre - turned[:2]), angle])
    return Alignment(motion, "headings" if is_open else "positions", common**0.5)


def _mean_angle(angles: Array) -> tuple[float, float]:
    """The mean direction of angles (N,), and their circular standard deviation; rad."""
    cos, sin = float(np.cos(angles).mean()), float(np.sin(angles).mean())
    length = min(np.hypot(cos, sin), 1.0)
    spread = float(np.sqrt(-2 * np.log(length))) if length > 0 else np.inf
    return float(np.arctan2(sin, cos)), spread


def spread_about(angles: Array) -> tuple[float, float]:
    """The mean (rad) of angles (N,) that lie together, and their standard deviation about it."""
    mean, _ = _mean_angle(angles)
    return mean, float(np.sqrt((wrap(angles - mean) ** 2).mean()))
