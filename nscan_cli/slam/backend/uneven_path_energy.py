"""The energy of a path along which a laser sweeps: how well its beams fit, and how steadily the robot moves.

The path is made of parts of steady motion from one knot to the next. The beams of a part are matched in
groups, each group from where the robot was in its middle; its derivatives are shared out to the knots on both
sides (the energy of pairwise matches, [19]). A change of motion from part to part costs as much as in
Cauchy's distribution: mostly there is hardly any, but where a robot begins to turn there is a large one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.ndt.association import association_buffers
from nscan_cli.ndt.energy import ENERGY_NUMBERS, evaluate_energy
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array, Indices

FIT, MOVED, CHANGES = 0, 1, 2
"""Terms of the energy: how the points fit, how far known poses have moved, and the changes of motion."""


class UnevenPathProblem(NamedTuple):
    """What the energy of K knots depends on."""

    grid: Grid
    half: float
    """Side (m) of a lattice cell of the grid that the points are matched with."""
    points: Array
    """(m, 2) in order of time."""
    shares: Array
    """(m,) share of the part that had passed when each point was seen."""
    ends: Indices
    """(G + 1,) group g has points[ends[g] : ends[g + 1]]."""
    groups: int
    """Groups in a part."""
    seconds: Array
    """(K − 1,) durations of the parts, s."""
    start: Array
    """(K, 3) poses of the knots before the match."""
    parts: int
    """Number of parts, and so of knots, from one known pose to the next."""
    scale: float
    """Factor that makes a negative log likelihood of the energy of the points."""
    sigmas: Array
    """(4,) standard deviations of the place (m) and heading (rad) of known poses, and the usual changes of
    speed (m/s) and turn rate (rad/s)."""


class UnevenPathSystem(NamedTuple):
    """The energy at some knots, and its derivatives."""

    terms: Array
    """(3,)"""
    gradient: Array
    """(K, 3)"""
    hessian: Array
    """(B, 3, 3) the semi-definite part, as the pattern has its blocks."""


@kernel
def evaluate_uneven_path(
    problem: UnevenPathProblem,
    starts: Indices,
    knots: Array,
    widening: float,
    stride: int,
    found: UnevenPathSystem,
) -> None:
    """Write the energy at the knots (K, 3), of one point in `stride`.

    `starts` (K + 1,) are those of the pattern's columns.
    """
    scale = problem.scale * stride
    terms, gradient, hessian = found
    terms[:] = 0.0
    gradient[:] = 0.0
    hessian[:] = 0.0
    moved, buffers = np.empty_like(problem.points), association_buffers(problem.points.shape[0], 1)
    pose, step, out, block = np.empty(3), np.empty(3), np.empty(ENERGY_NUMBERS), np.empty((3, 3))
    for group in range(problem.ends.shape[0] - 1):
        part, number = group // problem.groups, group % problem.groups
        begin, end = problem.ends[group], problem.ends[group + 1]
        after = (number + 0.5) / problem.groups
        before = 1.0 - after
        for a in range(3):
            step[a] = knots[part + 1, a] - knots[part, a]
            pose[a] = knots[part, a] + after * step[a]
        points, shares = problem.points[begin:end], problem.shares[begin:end]
        count = _seen_from_group(points, shares, stride, after, step, pose[2], moved)
        evaluate_energy(problem.grid, problem.half, moved[:count], pose, widening, 0.0, 0.0, 1, buffers, out)
        terms[FIT] += scale * out[0]
        first, second = starts[part], starts[part + 1]
        at = 4
        for a in range(3):
            gradient[part, a] += before * scale * out[1 + a]
            gradient[part + 1, a] += after * scale * out[1 + a]
            for b in range(a, 3):
                block[a, b] = block[b, a] = scale * out[at]
                at += 1
        for a in range(3):
            for b in range(3):
                hessian[first, a, b] += before * before * block[a, b]
                hessian[first + 1, a, b] += before * after * block[a, b]
                hessian[second, a, b] += after * after * block[a, b]
    for k in range(0, knots.shape[0], problem.parts):
        for a in range(3):
            information = problem.sigmas[a // 2] ** -2
            off = knots[k, a] - problem.start[k, a]
            terms[MOVED] += 0.5 * information * off * off
            gradient[k, a] += information * off
            hessian[starts[k], a, a] += information
    for k in range(1, knots.shape[0] - 1):
        terms[CHANGES] += _add_change(problem, knots, k, starts, gradient, hessian)


@leaf_kernel
def _seen_from_group(
    points: Array, shares: Array, stride: int, at: float, step: Array, heading: float, out: Array
) -> int:
    """Write points (m, 2) from the pose of their group, at a share of the step (3,) of their part.

    They were seen at the `shares` (m,) of it. Of them one in `stride` is written; returns their number.
    Within a part the chord is as good as the arc.
    """
    cos, sin = np.cos(heading), np.sin(heading)
    ahead, aside = cos * step[0] + sin * step[1], cos * step[1] - sin * step[0]
    count = (points.shape[0] + stride - 1) // stride
    for n in range(count):
        k = n * stride
        share = shares[k] - at
        # The series are exact to 1e-12 at half a radian.
        turn = share * step[2]
        t = turn * turn
        c = 1.0 - t / 2.0 * (1.0 - t / 12.0 * (1.0 - t / 30.0 * (1.0 - t / 56.0 * (1.0 - t / 90.0))))
        s = turn * (1.0 - t / 6.0 * (1.0 - t / 20.0 * (1.0 - t / 42.0 * (1.0 - t / 72.0))))
        out[n, 0] = c * points[k, 0] - s * points[k, 1] + share * ahead
        out[n, 1] = s * points[k, 0] + c * points[k, 1] + share * aside
    return int(count)


@leaf_kernel
def _add_change(
    problem: UnevenPathProblem, knots: Array, k: int, starts: Indices, gradient: Array, hessian: Array
) -> float:
    """Add what the change of the velocity at knot k costs; returns that."""
    before, after = 1.0 / problem.seconds[k - 1], 1.0 / problem.seconds[k]
    # Going on steadily, the robot's velocity turns with it.
    turn = 0.5 * (knots[k + 1, 2] - knots[k - 1, 2])
    cos, sin = np.cos(turn), np.sin(turn)
    vx, vy = before * (knots[k, 0] - knots[k - 1, 0]), before * (knots[k, 1] - knots[k - 1, 1])
    x = after * (knots[k + 1, 0] - knots[k, 0]) - cos * vx + sin * vy
    y = after * (knots[k + 1, 1] - knots[k, 1]) - sin * vx - cos * vy
    phi = after * (knots[k + 1, 2] - knots[k, 2]) - before * (knots[k, 2] - knots[k - 1, 2])
    speed, rate = problem.sigmas[2] ** -2, problem.sigmas[3] ** -2
    moves, turns = speed * (x * x + y * y), rate * phi * phi
    # The weights of Cauchy's distribution, as in iterated least squares.
    w, wt = speed / (1.0 + moves), rate / (1.0 + turns)
    # Derivatives by the three knots: before R, −before R − after, after, with R the rotation by `turn`.
    rx, ry = cos * x + sin * y, cos * y - sin * x
    for a in range(3):
        weight = w if a < 2 else wt
        ahead = (x, y, phi)[a] * weight
        turned = (rx, ry, phi)[a] * weight
        gradient[k - 1, a] += before * turned
        gradient[k, a] -= before * turned + after * ahead
        gradient[k + 1, a] += after * ahead
        for b in range(3):
            diagonal = weight if a == b else 0.0
            if a == 2 or b == 2:
                rotated = both = diagonal
                both *= 2.0
            else:
                rotated = weight * (cos if a == b else (-sin if a < b else sin))
                both = 2.0 * cos * weight if a == b else 0.0
            hessian[starts[k - 1], a, b] += before * before * diagonal
            hessian[starts[k], a, b] += (before * before + after * after) * diagonal + before * after * both
            hessian[starts[k + 1], a, b] += after * after * diagonal
            hessian[starts[k - 1] + 1, a, b] -= before * before * diagonal + before * after * rotated
            hessian[starts[k] + 1, a, b] -= after * after * diagonal + before * after * rotated
            hessian[starts[k - 1] + 2, a, b] += before * after * rotated
    return float(0.5 * (np.log1p(moves) + np.log1p(turns)))
