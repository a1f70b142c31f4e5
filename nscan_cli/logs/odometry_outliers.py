"""Single wrong values of the odometry: a driver that sends zeros now and then, a bit that flips.

The poses before and behind agree with each other, and such a value is far from both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.files.text import counted
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.robot_path import steady_between
from nscan_cli.logs.scan_order import usual_period
from nscan_cli.logs.steady_way import Places, are_regular, farthest_by_force, new_poses, off_steady_way
from nscan_cli.poses import Array, Mask, are_known, relative


@dataclass(frozen=True)
class OdometryOutlierOptions:
    """When poses of the odometry are single wrong values."""

    factor: float = 5.0
    """A wrong pose is farther from those before and behind than this multiple of the usual longest step. A
    larger value finds fewer."""
    min_distance: float = 1.0
    """A wrong pose is farther from those before and behind than this, m and rad: a match corrects a smaller
    error by itself, and where messages come in the wrong order poses go to and fro by up to 0.9 rad on real
    logs. A larger value finds fewer."""
    quantile: float = 0.99
    """Quantile of the steps that is the usual longest one; of three poses the shortest step counts, so that
    single wrong values do not. A larger value finds fewer."""
    max_return: float = 0.5
    """The poses before and behind are apart by at most this share of the distance to both. A larger value
    finds more, also where odometry begins anew twice."""
    most_poses: int = 5
    """Largest number of successive wrong poses. A larger value finds longer stretches, and guesses more of
    the way."""
    min_single: float = 0.3
    """Where poses come regularly, a single one is found from this distance on, m and rad, if the two before
    and the two behind lie on one steady way. A larger value finds fewer."""
    max_acceleration: float = 5.0
    """No robot with a laser speeds up, brakes, or begins to turn faster, m/s² and rad/s². A larger value
    finds less."""
    max_beside: float = 0.4
    """The two poses before a single wrong one and the two behind are off their steady way, or elsewhere
    apart, by less than this share of its distance. A larger value finds more, also where odometry is
    coarse."""
    regular: float = 1.6
    """Poses come regularly where times are apart as usual, within this factor. A larger value finds more,
    also where they come in the wrong order."""
    max_share: float = 0.34
    """With a larger share of wrong poses it is open which are right, and none is replaced. A larger value
    believes more."""


def without_outliers(
    odometry: Array,
    times: Array,
    options: OdometryOutlierOptions = OdometryOutlierOptions(),
    is_measured: bool = True,
) -> tuple[Array, str]:
    """Odometry (S, 3) at times (S,), s, steady where single values are wrong; and what to say.

    Unknown poses are nan and stay so. The text is empty where nothing is changed. If times are not measured
    but made up, they are even where the robot's motion is not.
    """
    if not is_measured:
        options = replace(options, min_single=np.inf)
    known = np.flatnonzero(are_known(odometry))
    poses, at = odometry[known], times[known]
    stretches = _with_others(_excursions(poses, at, options), _singles(poses, at, options))
    wrong = poses[_between(stretches, len(poses))]
    if not 0 < len(wrong) <= options.max_share * len(poses):
        return odometry, ""
    values = counted(len(wrong), "single wrong value")
    said = f"odometry has {values}, far from those before and behind, which agree"
    if len(wrong) > 1 and (wrong == wrong[0]).all():
        # The same value is as wrong where the robot is near to it.
        runs = mask_runs((poses == wrong[0]).all(axis=1))
        stretches = [
            (first - 1, end)
            for first, end in runs
            if first > 0 and end < len(poses) and end - first <= options.most_poses
        ]
        said += f" (all are {', '.join(f'{part:.4g}' for part in wrong[0])})"
    evened = odometry.copy()
    evened[known] = steady_between(poses, at, stretches)
    since = at[stretches[0][0] + 1] - at[0]
    return evened, (
        f"{said}; the first is {since:.1f} s after the beginning; the robot is taken to move steadily there; "
        "--as-recorded believes the log"
    )


def _with_others(stretches: list[tuple[int, int]], others: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Stretches, each by the rows before and behind it, and those others that overlap none of them."""
    free = [each for each in others if all(each[1] <= a or b <= each[0] for a, b in stretches)]
    return sorted([*stretches, *free])


def _singles(poses: Array, times: Array, options: OdometryOutlierOptions) -> list[tuple[int, int]]:
    """The rows before and behind each single wrong pose (n, 3), known at times (n,), s.

    Where times are irregular poses may be in the wrong order, and only farther ones are found.
    """
    rows = new_poses(poses, times)
    if len(rows) < 5:
        return []
    some, at = poses[rows], times[rows]
    # Each third of five poses, and the second and the fourth without it.
    around: list[tuple[Places, int]] = [((0, 1, 2), 1), ((0, 1, 3), 0), ((0, 2, 3), 1)]
    regular = np.all(
        [are_regular(at, at_places, options.regular)[k : len(some) - 4 + k] for at_places, k in around],
        axis=0,
    )
    own, *others = (
        _sizes(off_steady_way(some, at, at_places)[k : len(some) - 4 + k]) for at_places, k in around
    )
    steps, longest = step_sizes(some[1:], some[:-1]), usual_longest_step(some, options)
    beside = np.maximum(steps[:-3], steps[3:])
    forces = farthest_by_force(at[3:-1] - at[1:-3], options.max_acceleration)
    is_off = own > np.maximum.reduce(np.broadcast_arrays(options.min_single, forces, beside, longest))
    is_off &= (np.maximum(*others) < options.max_beside * own) & regular[:, None]
    away = np.minimum(steps[1:-2], steps[2:-1])
    apart = beside + step_sizes(some[3:-1], some[1:-3])
    is_off |= (away > np.maximum(np.maximum(options.min_distance, forces), options.factor * longest)) & (
        apart < options.max_beside * away
    )
    return [(int(rows[k + 1]), int(rows[k + 3])) for k in np.flatnonzero(is_off.any(axis=1)).tolist()]


def _sizes(off: Array) -> Array:
    """(…, 2) length, m, and turn, rad, of differences (…, 3)."""
    return np.stack([np.hypot(off[..., 0], off[..., 1]), np.abs(off[..., 2])], axis=-1)


def _between(stretches: list[tuple[int, int]], size: int) -> Mask:
    """(size,) which rows lie between the two rows of a stretch."""
    between = np.zeros(size, dtype=np.bool_)
    for first, last in stretches:
        between[first + 1 : last] = True
    return between


def _excursions(poses: Array, times: Array, options: OdometryOutlierOptions) -> list[tuple[int, int]]:
    """The rows before and behind each stretch of wrong poses (n, 3), known at times (n,), s."""
    if len(poses) < 3:
        return []
    steps = step_sizes(poses[1:], poses[:-1])
    limits = np.maximum(options.factor * usual_longest_step(poses, options), options.min_distance)
    # After a pause a step may be longer in proportion.
    periods = np.maximum(np.diff(times) / (usual_period(times) or 1.0), 1.0)
    far = np.flatnonzero((steps > limits * periods[:, None]).any(axis=1)).tolist()
    found: list[tuple[int, int]] = []
    for k, away in enumerate(far):
        if found and away < found[-1][1]:
            continue
        for back in far[k + 1 : k + 1 + options.most_poses]:
            apart = step_sizes(poses[back + 1], poses[away])
            excursion = np.minimum(steps[away], steps[back])
            is_excursion = (excursion > limits) & (apart <= options.max_return * excursion)
            is_near = back - away <= options.most_poses and (apart <= limits).all()
            if is_excursion.any() and is_near and times[back + 1] > times[away]:
                found.append((away, back + 1))
                break
    return found


def usual_longest_step(poses: Array, options: OdometryOutlierOptions = OdometryOutlierOptions()) -> Array:
    """(2,) length, m, and turn, rad, of the usual longest step between poses (n, 3), three at least."""
    steps = step_sizes(poses[1:], poses[:-1])
    least = np.minimum(np.minimum(steps[1:], steps[:-1]), step_sizes(poses[2:], poses[:-2]))
    usual: Array = np.quantile(least, options.quantile, axis=0, method="lower")
    return usual


def step_sizes(poses: Array, others: Array) -> Array:
    """(…, 2) length, m, and turn, rad, of the steps to poses (…, 3) from others."""
    return _sizes(relative(poses, others))
