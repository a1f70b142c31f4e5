"""The robot's path as poses at increasing times, and where it is between two of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, llvm_inline_kernel
from nscan_cli.poses import Array, Indices, are_known, compose, relative, wrap

STRAIGHT = 1e-9
"""rad; a turn smaller than this is none: its arc is a straight line."""


@dataclass(frozen=True)
class RobotPathOptions:
    """How a robot moves between two poses."""

    longest_step: float = 1.0
    """Longest time between two poses that tells how the robot came from one to the other, s. Over a longer
    one it goes on as before. A larger value believes more steps."""
    fastest: float = 10.0
    """Greatest speed of a robot with a laser, m/s. A faster one was carried, or lost, and goes on as before.
    A larger value believes more steps."""
    fastest_turn: float = 15.0
    """Greatest turn rate of a robot with a laser, rad/s. One that turns faster goes on as before. A larger
    value believes more steps."""
    least_poses: int = 10
    """Least number of poses that tell whether odometry or steady motion leads better from one to the next.
    With fewer it is odometry. A larger value believes odometry in more short logs."""
    metres_per_radian: float = 1.0
    """Length of a beam at whose end errors of headings and of places are compared, m. A larger value gives
    the headings more weight."""


class RobotPath(NamedTuple):
    """Poses at P ≥ 2 times. From one to the next the robot moves steadily: along an arc, as wheels do."""

    times: Array
    """(P,) increasing, s."""
    poses: Array
    """(P, 3)"""
    twists: Array
    """(P, 3) velocities from each pose to the next in the frame of the first, m/s and rad/s. The last one
    goes on as the one before."""
    headings: Array
    """(P, 2) cosine and sine of each heading."""


def robot_path(times: Array, poses: Array) -> RobotPath | None:
    """The path through poses (S, 3) at times (S,), s, that do not decrease; None with fewer than two.

    Unknown poses are left out, and all but the first of those at one time.
    """
    options = RobotPathOptions()
    known = np.flatnonzero(are_known(poses))
    used = known[np.diff(times[known], prepend=-np.inf) > 0.0]
    if len(used) < 2:
        return None
    at, through = np.ascontiguousarray(times[used]), np.ascontiguousarray(poses[used])
    periods, twists = np.diff(at), np.empty((len(used), 3))
    twists[:-1] = _velocities(relative(through[1:], through[:-1]), periods)
    unknown = periods > options.longest_step
    unknown |= np.hypot(twists[:-1, 0], twists[:-1, 1]) > options.fastest
    unknown |= np.abs(twists[:-1, 2]) > options.fastest_turn
    for row in np.flatnonzero(unknown).tolist():
        twists[row] = twists[row - 1] if row else 0.0
    twists[-1] = twists[-2]
    return RobotPath(at, through, twists, np.column_stack([np.cos(through[:, 2]), np.sin(through[:, 2])]))


def bent_path(path: RobotPath, times: Array, poses: Array) -> RobotPath | None:
    """The path through poses (S, 3) at times (S,), s, with the motion between two of them as `path` has it.

    What `path` is off between two poses is shared out over the time between them.
    """
    inside = (path.times > times[0]) & (path.times < times[-1])
    at = path.times[inside]
    after = np.searchsorted(times, at)
    before = after - 1
    share = (at - times[before]) / (times[after] - times[before])
    blended = bent_between(path.poses[inside], poses_at(path, times), poses, (before, after), share)
    # Those of the scans come first where both are at one time.
    order = np.argsort(np.concatenate([times, at]), kind="stable")
    return robot_path(np.concatenate([times, at])[order], np.concatenate([poses, blended])[order])


def bent_between(
    path: Array, anchors: Array, moved: Array, beside: tuple[Indices, Indices], share: Array
) -> Array:
    """Poses (n, 3) of a path whose anchors (K, 3), also on the path, have `moved` (K, 3).

    `beside` are the anchors (n,) before and after each pose. If these have moved against each other, a pose
    has two places, one as seen from each. It is put between both, at its `share` (n,) of the way.
    """
    from_before, from_after = (compose(moved[anchor], relative(path, anchors[anchor])) for anchor in beside)
    apart = from_after - from_before
    apart[:, 2] = wrap(apart[:, 2])
    bent: Array = from_before + share[:, None] * apart
    bent[:, 2] = wrap(bent[:, 2])
    return bent


def likelier_path(path: RobotPath, times: Array, poses: Array) -> RobotPath | None:
    """The path through poses (S, 3) at times (S,), s: bent, with the motion of `path` between two of them, or
    steady there if that tells better where every second pose is from those beside it.

    Odometry whose clock or wheels are off leads astray between two poses.
    """
    options = RobotPathOptions()
    steady, bent = robot_path(times, poses), bent_path(path, times, poses)
    if len(times) < options.least_poses or steady is None or bent is None:
        return bent
    some, others = slice(None, None, 2), slice(1, None, 2)
    errors = []
    for each in (robot_path(times[some], poses[some]), bent_path(path, times[some], poses[some])):
        if each is None:
            return bent
        off = relative(poses_at(each, times[others]), poses[others])
        away = np.hypot(off[:, 0], off[:, 1]) + options.metres_per_radian * np.abs(off[:, 2])
        errors.append(float(away.mean()))
    return steady if errors[0] < errors[1] else bent


def steady_between(poses: Array, times: Array, stretches: Iterable[tuple[int, int]]) -> Array:
    """Poses (S, 3) at times (S,), s, with those between the two rows of each stretch on its chord, by time.

    Where stretches overlap, a later one goes by what an earlier one gave.
    """
    evened = poses.copy()
    for first, last in stretches:
        shares = (times[first + 1 : last] - times[first]) / (times[last] - times[first])
        step = relative(evened[last], evened[first])
        evened[first + 1 : last] = compose(evened[first], shares[:, None] * step)
    return evened


def poses_at(path: RobotPath, times: Array) -> Array:
    """(n, 3) poses of a path at times (n,), s."""
    rows = np.clip(np.searchsorted(path.times, times, side="right") - 1, 0, len(path.times) - 1)
    twists, seconds = path.twists[rows], times - path.times[rows]
    turns = twists[:, 2] * seconds
    turning = np.abs(turns) > STRAIGHT
    rates = np.where(turning, twists[:, 2], 1.0)
    along = np.where(turning, np.sin(turns) / rates, seconds)
    aside = np.where(turning, (1.0 - np.cos(turns)) / rates, 0.0)
    x, y = twists[:, 0], twists[:, 1]
    return compose(path.poses[rows], np.stack([along * x - aside * y, aside * x + along * y, turns], axis=1))


def _velocities(steps: Array, periods: Array) -> Array:
    """(n, 3) steady velocities, m/s and rad/s, that lead over steps (n, 3) in the periods (n,), s."""
    half = 0.5 * steps[:, 2]
    # An arc turns its chord by half of its turn, and is longer by that angle over its sine.
    turning = np.abs(half) > STRAIGHT
    share = np.where(turning, half / np.tan(np.where(turning, half, 1.0)), 1.0)
    x, y = steps[:, 0], steps[:, 1]
    found: Array = np.stack([share * x + half * y, share * y - half * x, steps[:, 2]], axis=1)
    return np.asarray(found / periods[:, None], dtype=np.float64)


@llvm_inline_kernel
def interval_at(times: Array, time: float, j: int) -> int:
    """The place in increasing times (P,) of the last that is not after `time`, looked for from j on.

    The first place if all are after it.
    """
    while j > 0 and times[j] > time:
        j -= 1
    while j + 1 < times.shape[0] and times[j + 1] <= time:
        j += 1
    return j


@llvm_inline_kernel
def along_arc(rate: float, seconds: float, cos: float, sin: float) -> tuple[float, float]:
    """How far (s) a velocity leads ahead and aside on an arc: one of 1 m/s as many metres.

    `cos` and `sin` are those of the turn, `rate` (rad/s) times `seconds`.
    """
    if abs(rate * seconds) <= STRAIGHT:
        return seconds, 0.0
    # Of small turns, the difference of one and the cosine would be rounding.
    versine = sin * sin / (1.0 + cos) if cos > 0.0 else 1.0 - cos
    return sin / rate, versine / rate


@llvm_inline_kernel
def seen_from(path: RobotPath, start: Array, time: float, j: int, out: Array) -> None:
    """Write the robot's pose at a time (s), after place j of its path, as seen from `start`.

    `start` (4,), in the frame of the path, and `out` (4,) are x, y (m), and the heading's cosine and sine.
    """
    seconds, rate = time - path.times[j], path.twists[j, 2]
    turn = rate * seconds
    cos, sin = np.cos(turn), np.sin(turn)
    along, aside = along_arc(rate, seconds, cos, sin)
    x = along * path.twists[j, 0] - aside * path.twists[j, 1]
    y = aside * path.twists[j, 0] + along * path.twists[j, 1]
    c, s = path.headings[j]
    dx, dy = path.poses[j, 0] + c * x - s * y - start[0], path.poses[j, 1] + s * x + c * y - start[1]
    cos, sin = c * cos - s * sin, s * cos + c * sin
    out[0], out[1] = start[2] * dx + start[3] * dy, start[2] * dy - start[3] * dx
    out[2], out[3] = start[2] * cos + start[3] * sin, start[2] * sin - start[3] * cos


@kernel
def move_along_arc(points: Array, shares: Array, step: Array, back: bool) -> None:
    """Move points (m, 2) along their shares (m,) of the arc of a step (3,), or back."""
    # The velocity at the middle: an arc turns its chord by half of its turn.
    half, rate = 0.5 * step[2], step[2]
    cotangent = half / np.tan(half) if abs(half) > STRAIGHT else 1.0
    ahead, left = cotangent * step[0] + half * step[1], cotangent * step[1] - half * step[0]
    for k in range(points.shape[0]):
        turn = rate * shares[k]
        cos, sin = np.cos(turn), np.sin(turn)
        along, aside = along_arc(rate, shares[k], cos, sin)
        x, y = along * ahead - aside * left, aside * ahead + along * left
        if back:
            dx, dy = points[k, 0] - x, points[k, 1] - y
            points[k, 0], points[k, 1] = cos * dx + sin * dy, cos * dy - sin * dx
        else:
            dx, dy = points[k, 0], points[k, 1]
            points[k, 0], points[k, 1] = cos * dx - sin * dy + x, sin * dx + cos * dy + y
