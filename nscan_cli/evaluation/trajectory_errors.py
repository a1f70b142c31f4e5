"""The error of a trajectory against a reference trajectory: absolute (ATE) and relative (RPE).

J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, in the plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.evaluation.alignment import Alignment, alignment
from nscan_cli.evaluation.clock_lag import lag_without_overlap
from nscan_cli.evaluation.options import EvaluationOptions
from nscan_cli.evaluation.statistics import Spread
from nscan_cli.evaluation.time_association import mutual_nearest, no_match
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array, Indices, compose, path_lengths, relative, wrap


@dataclass(frozen=True)
class TrajectoryErrors:
    """Translations in m, rotations in degrees."""

    matched: int
    """Number of poses of the result with a match in the reference."""
    unmatched: int
    """Number of poses of the result without a match."""
    alignment: Alignment
    """Takes the result into the frame of the reference."""
    rows: Indices
    """(matched,) rows of the result with a match."""
    partners: Indices
    """(matched,) rows of the reference that match them."""
    translation: Array
    """(matched,) m, absolute, of the poses in `rows`."""
    absolute_translation: Spread
    absolute_rotation: Spread
    relative_translation: Spread | None
    """Per `relative_distance` of path; None where the matched path is shorter than that."""
    relative_rotation: Spread | None


def trajectory_errors(
    result: Trajectory, reference: Trajectory, name: str = "result", reference_name: str = "the reference"
) -> TrajectoryErrors:
    """ATE after the best rigid alignment (alignment.py), and RPE, of the poses that match in time.

    Poses match that are each other's nearest in time, at most `tolerance` apart. The RPE compares the motion
    from every matched pose to the first one at least `relative_distance` of path later. Messages use the
    names. Raises InputDataError when fewer than two poses match.
    """
    options = EvaluationOptions()
    rows, partners = mutual_nearest(result.times, reference.times, options.tolerance)
    if len(rows) == 0:
        lag = lag_without_overlap(result, reference, options.remarks)
        fits = "" if lag is None else f"; stamps off by {lag:+.2f} s fit best"
        raise no_match(name, result.times, reference_name, reference.times, fits)
    if len(rows) == 1:
        problem = f"only one pose matches {reference_name}"
        raise InputDataError(name, problem, "give a reference that covers more of it")
    poses, truth = result.poses[rows], reference.poses[partners]
    found = alignment(poses, truth, options.alignment)
    aligned = compose(found.motion, poses)
    translation = np.hypot(*(aligned - truth)[:, :2].T)
    relative_errors = _relative_errors(poses, truth, options.relative_distance)
    return TrajectoryErrors(
        matched=len(rows),
        unmatched=len(result) - len(rows),
        alignment=found,
        rows=rows,
        partners=partners,
        translation=translation,
        absolute_translation=Spread.of(translation),
        absolute_rotation=Spread.of(np.degrees(np.abs(wrap(aligned[:, 2] - truth[:, 2])))),
        relative_translation=Spread.of(relative_errors[0]) if len(relative_errors[0]) else None,
        relative_rotation=Spread.of(relative_errors[1]) if len(relative_errors[1]) else None,
    )


def _relative_errors(poses: Array, truth: Array, distance: float) -> tuple[Array, Array]:
    """Errors (M,) in m and degrees of the motions over a `distance` (m) of the true path."""
    path = path_lengths(truth)
    # Rounding of the sum of steps must not decide which pose is taken.
    ends = np.searchsorted(path, path + distance - 1e-9)
    starts = np.flatnonzero(ends < len(path))
    ends = ends[starts]
    error = relative(poses[ends], poses[starts]) - relative(truth[ends], truth[starts])
    return np.hypot(error[:, 0], error[:, 1]), np.degrees(np.abs(wrap(error[:, 2])))
