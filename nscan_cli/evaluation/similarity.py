"""Fits of one path to another: similarity transforms, mirror images, and lever arms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nscan_cli.evaluation.alignment import alignment, circular_mean
from nscan_cli.poses import Array, compose, wrap


@dataclass(frozen=True)
class SimilarityFit:
    """Least-squares fits of positions a (N, 2) to b (N, 2); RMS lengths in the unit of b."""

    factor: float
    """Scale of a."""
    spread: float
    """Spread of b about its mean."""
    apart: float
    """Residual without the factor."""
    apart_scaled: float
    """Residual with the factor."""
    apart_mirrored: float
    """Residual with the factor and a mirrored."""


def fit_similarity(poses: Array, truth: Array) -> SimilarityFit:
    """The least-squares fits of positions in closed form, from sums about their means."""
    a, b = poses[:, :2] - poses[:, :2].mean(axis=0), truth[:, :2] - truth[:, :2].mean(axis=0)
    size_a, size_b = float((a**2).sum() / len(a)), float((b**2).sum() / len(b))
    (xx, xy), (yx, yy) = (a.T @ b / len(a)).tolist()
    common, mirrored = float(np.hypot(xx + yy, xy - yx)), float(np.hypot(xx - yy, xy + yx))

    def left(shared: float) -> float:
        return math.sqrt(max(size_b - shared**2 / size_a, 0.0) if size_a > 0 else size_b)

    return SimilarityFit(
        factor=common / size_a if size_a > 0 else 1.0,
        spread=size_b**0.5,
        apart=max(size_a + size_b - 2 * common, 0.0) ** 0.5,
        apart_scaled=left(common),
        apart_mirrored=left(mirrored),
    )


@dataclass(frozen=True)
class LeverArm:
    """The point of the robot that the reference tracks, seen from the point that the result tracks."""

    point: Array
    """(2,) ahead and to the left, in the unit of the result."""
    sigma: float
    """Of the point, in its most uncertain direction."""
    apart: float
    """Residual of the positions (RMS), in the unit of the reference."""


def lever_arm(poses: Array, truth: Array, max_condition: float) -> LeverArm | None:
    """The lever arm of poses (N, 3) to positions in truth (N, 3); None where the headings leave it open.

    They do where the condition number of the system exceeds `max_condition`.

    b = t + k R(θ) a + k R(θ + φ) l by least squares, linear in t, in k (cos θ, sin θ), and in k R(θ) l.
    Where the headings decide the alignment (alignment.py), θ is theirs, and k is 1.
    """
    aligned = alignment(poses, truth)
    a, b = poses[:, :2] - poses[:, :2].mean(axis=0), truth[:, :2] - truth[:, :2].mean(axis=0)
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    one, none = np.ones(len(a)), np.zeros(len(a))
    rows = [[one, none, cos, -sin], [none, one, sin, cos]]
    by_headings = aligned.by == "headings"
    if by_headings:
        b = b - compose([0.0, 0.0, aligned.motion[2]], np.column_stack([a, none]))[:, :2]
    else:
        rows = [[*rows[0], a[:, 0], -a[:, 1]], [*rows[1], a[:, 1], a[:, 0]]]
    design = np.vstack([np.column_stack(row) for row in rows])
    scatter = design.T @ design / len(a)
    if np.linalg.cond(scatter) > max_condition:
        return None
    wanted = np.concatenate([b[:, 0], b[:, 1]])
    found = np.linalg.solve(scatter, design.T @ wanted / len(a))
    apart = float(np.sqrt(((wanted - design @ found) ** 2).sum() / len(a)))
    angle, factor = aligned.motion[2], 1.0
    if not by_headings:
        angle, factor = np.arctan2(found[5], found[4]), float(np.hypot(found[4], found[5]))
    # Errors of trajectories are correlated: more poses do not reduce the uncertainty.
    sigma = apart * float(np.sqrt(np.linalg.eigvalsh(np.linalg.inv(scatter)[2:4, 2:4])[-1]))
    point = compose([0.0, 0.0, -float(angle)], [*found[2:4], 0.0])[:2]
    return LeverArm(point / factor, sigma / factor, apart)


def heading_difference(poses: Array, truth: Array) -> tuple[float, float]:
    """Mean and standard deviation of the headings of truth minus those of the poses after alignment, rad."""
    angles = truth[:, 2] - poses[:, 2] - alignment(poses, truth).motion[2]
    mean, _ = circular_mean(angles)
    return mean, float(np.sqrt((wrap(angles - mean) ** 2).mean()))
