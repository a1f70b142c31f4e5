"""Remarks on differences of result and reference that errors do not show: clocks, units, frames, and others.

No remark changes an error. Each has its figure, and is made only where it is certain: with it, the positions
fit several times better, and so well that little else can be wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from nscan_cli.evaluation.alignment import alignment
from nscan_cli.evaluation.clock_lag import Clocks
from nscan_cli.evaluation.options import EvaluationOptions, RemarkOptions
from nscan_cli.evaluation.similarity import (
    LeverArm,
    SimilarityFit,
    fit_similarity,
    heading_difference,
    lever_arm,
)
from nscan_cli.evaluation.trajectory_errors import TrajectoryErrors
from nscan_cli.files.text import counted
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array, compose

UNIT_FACTORS = {1000.0: "millimetres", 100.0: "centimetres", 1 / 0.3048: "feet", 1 / 0.0254: "inches"}
OTHER_POINT = "the reference is of another point of the robot"


def remarks(result: Trajectory, reference: Trajectory, errors: TrajectoryErrors) -> Iterator[str]:
    """Sentences on what differs between a result and a reference; none where nothing does."""
    options = EvaluationOptions.remarks
    both = (("result", result), ("reference", reference))
    mixed = [(name, said) for name, trajectory in both if (said := _two_runs(trajectory, options))]
    for name, said in mixed:
        yield f"the {name} has two runs under the same stamps: {said}"
    for name, trajectory in both:
        yield from _out_of_plane_motion(trajectory, name, options)
    # Fits mean nothing where two runs are mixed.
    if not mixed:
        yield from _misfits(result, reference, errors, options)


def _two_runs(trajectory: Trajectory, options: RemarkOptions) -> str:
    """What shows that a file has two runs; empty where nothing does."""
    places, times = trajectory.poses[:, :2], trajectory.times
    steps = np.hypot(*np.diff(places, axis=0).T)
    if trajectory.rows is not None:
        written = np.argsort(trajectory.rows)
        on = np.diff(times[written]) >= 0
        backward = int(np.sum(~on))
        path, there = float(np.hypot(*np.diff(places[written], axis=0)[on].T).sum()), float(steps.sum())
        if backward and there > options.path_ratio * path + options.repeated_distance:
            return (
                f"time goes back {counted(backward, 'time')} in it, and in order of time its poses jump back "
                f"and forth (a path of {there:.1f} m instead of {path:.1f} m)"
            )
    same = np.diff(times) == 0
    firsts = places[np.append(True, ~same)]
    typical = float(np.median(np.hypot(*np.diff(firsts, axis=0).T))) if len(firsts) > 1 else 0.0
    apart = steps[same & (steps > max(options.repeated_distance, options.improvement * typical))]
    if len(apart) >= max(options.min_repeated, options.repeated_share * len(times)):
        return f"{counted(len(apart), 'stamp')} twice, with poses up to {apart.max():.2f} m apart"
    return ""


def _out_of_plane_motion(trajectory: Trajectory, name: str, options: RemarkOptions) -> Iterator[str]:
    if trajectory.spatial is None or len(trajectory) < 2:
        return
    heights, up = trajectory.spatial[:, 0], trajectory.spatial[:, 1:]
    upright = np.median(up, axis=0)
    upright /= max(float(np.linalg.norm(upright)), 1e-12)
    low, high = np.percentile(heights, [options.height_outliers, 100.0 - options.height_outliers])
    tilts = np.arccos(np.clip(up @ upright, -1, 1))
    tilt = float(np.percentile(tilts, 100.0 - options.tilt_outliers))
    lean = float(np.arccos(np.clip(upright[2], -1, 1)))
    moves = [f"z by {high - low:.2f} m"] if high - low > options.max_height else []
    moves += [f"roll and pitch by up to {math.degrees(tilts.max()):.1f}°"] if tilt > options.max_tilt else []
    if moves:
        yield (
            f"the {name} moves out of the plane, {' and '.join(moves)}: x, y and heading alone are compared"
        )
    if lean > options.max_tilt and tilt <= options.max_tilt:
        yield (
            f"the {name} is tilted by {math.degrees(lean):.1f}° throughout: its frame is not that of a robot "
            "on the floor, and its headings are about another axis"
        )


def _misfits(
    result: Trajectory, reference: Trajectory, errors: TrajectoryErrors, options: RemarkOptions
) -> Iterator[str]:
    poses, truth = result.poses[errors.rows], reference.poses[errors.partners]
    now = fit_similarity(poses, truth)
    # Either of them can be in a larger unit.
    if (
        errors.alignment.by == "headings"
        or max(now.spread, fit_similarity(truth, poses).spread) < options.min_motion
    ):
        found = _certain_lever_arm(poses, truth, options)
        if found is not None:
            yield f"{OTHER_POINT}: {_point_text(found.point)} that of the result"
        return
    if _is_better(now.apart_mirrored, now.apart_scaled, now, options):
        yield (
            "the result is the mirror image of the reference: mirrored, its error is "
            f"{now.apart_mirrored:.3g} m (RMS) instead of {now.apart_scaled:.3g} m"
        )
        return
    clocks = Clocks.of(result.times[errors.rows], poses, reference, options.clock_lag)
    lag, found, either = _lag_and_lever(clocks, _certain_lever_arm(poses, truth, options), now, options)
    if lag:
        poses, truth = replace(clocks, times=result.times[errors.rows], poses=poses).at(lag)
    if found is not None and not either:
        poses = compose(poses, [*found.point, 0.0])
    left = fit_similarity(poses, truth)
    if lag:
        clock = f"the clock of the reference is {'ahead of' if lag > 0 else 'behind'} that of the result"
        alone = f"stamps off by {abs(lag):.2f} s fit best"
        if either and found is not None:
            yield f"{alone} ({clock}), or else {OTHER_POINT}, {_point_text(found.point)} that of the result"
        else:
            yield f"{alone}: {clock}"
    factor = left.factor
    is_other_unit = abs(math.log(max(factor, 1e-12))) > options.min_factor
    if is_other_unit and _is_better(left.apart_scaled, left.apart, now, options):
        yield f"factor {_factor_text(factor, options.unit_tolerance)}"
        truth = truth / [factor, factor, 1.0]
        left = fit_similarity(poses, truth)
    if left.apart < 2 * options.max_residual * left.spread:
        turn, spread = heading_difference(poses, truth)
        if abs(turn) > max(options.min_turn, options.min_sigmas * max(spread, left.apart / left.spread)):
            side = f", those of the reference to the {'left' if turn > 0 else 'right'}"
            yield (
                f"the headings differ by {math.degrees(abs(turn)):.1f}° ± {math.degrees(spread):.1f}° "
                f"throughout: frames turned{side if abs(turn) < options.max_side_turn else ''}"
            )
    if found is not None and not either:
        yield f"{OTHER_POINT}: {_point_text(found.point)} that of the result"


def _lag_and_lever(
    clocks: Clocks, found: LeverArm | None, now: SimilarityFit, options: RemarkOptions
) -> tuple[float, LeverArm | None, bool]:
    """The lag (s; 0: none) and the lever arm that are certain, and whether only one of them is meant.

    On a straight path, a lag looks like a lever arm. Both together are reported only where neither alone
    fits nearly as well.
    """
    alone = clocks.best(lambda poses, truth: fit_similarity(poses, truth).apart_scaled)
    most = options.max_condition
    both = clocks.best(lambda poses, truth: getattr(lever_arm(poses, truth, most), "apart", math.inf))
    least = min(
        [now.apart_scaled, *(one[1] for one in (alone, both) if one)] + ([found.apart] if found else [])
    )
    alone, both = (one if one and abs(one[0]) >= options.clock_lag.min_lag else None for one in (alone, both))
    by_lag = alone if alone and _is_better(alone[1], now.apart_scaled, now, options) else None
    # The remaining residual may be only rounding.
    enough = options.as_good * least + options.rounding * now.spread
    if by_lag and by_lag[1] <= enough:
        either = found is not None and found.apart <= enough
        return by_lag[0], found if either else None, either
    if found is not None and found.apart <= enough:
        return 0.0, found, False
    if both and _is_better(both[1], now.apart_scaled, now, options):
        together = _certain_lever_arm(*clocks.at(both[0]), options)
        if together is not None:
            return both[0], together, False
    return (by_lag[0], None, False) if by_lag else (0.0, found, False)


def _certain_lever_arm(poses: Array, truth: Array, options: RemarkOptions) -> LeverArm | None:
    found = lever_arm(poses, truth, options.max_condition)
    if found is None or np.hypot(*found.point) < max(options.min_lever, options.min_sigmas * found.sigma):
        return None
    aligned = alignment(poses, truth)
    apart = fit_similarity(poses, truth).apart_scaled
    if aligned.by == "headings":
        apart = float(np.sqrt(((compose(aligned.motion, poses) - truth)[:, :2] ** 2).sum() / len(poses)))
    return found if found.apart * options.lever_improvement < apart else None


def _is_better(apart: float, before: float, now: SimilarityFit, options: RemarkOptions) -> bool:
    return apart * options.improvement < before and apart < options.max_residual * now.spread


def _factor_text(factor: float, tolerance: float) -> str:
    """What a factor from the result to the reference means."""
    larger, which = (factor, "reference") if factor > 1 else (1 / factor, "result")
    for size, unit in UNIT_FACTORS.items():
        if abs(larger / size - 1) < tolerance:
            return f"{size:.4g}: the {which} seems to be in {unit}"
    return f"{larger:.3f}: the {which} is larger by this factor"


def _point_text(point: Array) -> str:
    """A point (2,) seen from the driver's seat."""
    x, y = point.tolist()
    parts = [
        f"{abs(value):.2f} m {ahead if value > 0 else behind}"
        for value, ahead, behind in ((x, "ahead of", "behind"), (y, "left of", "right of"))
        if abs(value) >= 0.005
    ]
    return " and ".join(parts)
