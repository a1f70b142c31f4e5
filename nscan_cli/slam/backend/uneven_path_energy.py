"""The energy of a path along which a laser sweeps: how well its beams fit, and how steadily the robot moves.

The path is made of parts of steady motion from one knot to the next. The beams of a part are matched in
groups, each group from where the robot was in its middle; its derivatives are shared out to the knots on both
sides (the energy of pairwise matches, [19]). A change of motion from part to part costs as much as in
Cauchy's distribution: mostly there is hardly any, but where a robot begins to turn there is a large one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import factorise_blocks, solve_lower, solve_upper
from nscan_cli.graph.linalg.factor_pattern import Pattern
from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.damped_newton import PAIRWISE_STEPS, is_accepted, is_last, next_damping
from nscan_cli.ndt.association import association_buffers
from nscan_cli.ndt.energy import ENERGY_NUMBERS, evaluate_energy
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.backend.options import UnevenMotionOptions

FIT, MOVED, CHANGES = 0, 1, 2
"""Terms of the energy: how the points fit, how far known poses have moved, and the changes of motion."""


class TimedPoints(NamedTuple):
    """Points that a laser saw one after another."""

    points: Array
    """(m, 2) points in the robot's frame, each from where it was then."""
    times: Array
    """(m,) s; increasing."""


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


class UnevenPathEnergy:
    """The energy of K ≥ 3 knots (x, y, φ), with φ that does not jump by 2π."""

    def __init__(
        self, reference: Ndt, seen: TimedPoints, times: Array, start: Array, options: UnevenMotionOptions
    ) -> None:
        """Match points `seen` from the first to the last of `times` (K,), s, with a reference.

        Of the knots `start` (K, 3) one in `options.parts` is a pose that is known.
        """
        seconds, groups = np.diff(times), options.groups
        part = np.searchsorted(times, seen.times, side="right") - 1
        shares = (seen.times - times[part]) / seconds[part]
        group = groups * part + np.minimum((groups * shares).astype(np.int64), groups - 1)
        ends = np.searchsorted(group, np.arange(groups * len(seconds) + 1))
        sigmas = np.array([options.sigma, options.turn_sigma, options.speed_change, options.turn_change])
        self._options, self._pattern = options, _band_pattern(len(times))
        self._problem = UnevenPathProblem(
            reference.grid, reference.half, seen.points, shares, ends, groups, seconds, start, options.parts,
            options.scale, sigmas,
        )  # fmt: skip

    def least(self) -> tuple[Array, float]:
        """The knots (K, 3) of least energy, and how much better the points fit there than at the start.

        Each stage ends with a step that moves no knot by more than its tolerance.
        """
        knots, options = self._problem.start.copy(), self._options
        tolerances = np.full(len(options.widenings), options.coarse_tolerance)
        tolerances[-1] = options.tolerance
        stages = np.array(options.widenings), tolerances
        gain = _descend(self._problem, self._pattern, knots, stages, options.iterations)
        return knots, gain


def _band_pattern(nodes: int) -> Pattern:
    """The pattern of the factor where each of at least 3 nodes has blocks with the next two, in order."""
    columns = np.arange(nodes)
    heights = np.minimum(3, nodes - columns)
    starts = np.concatenate([[0], np.cumsum(heights)])
    rows = np.arange(starts[-1]) - np.repeat(starts[:-1] - columns, heights)
    return Pattern(columns, starts, rows, np.arange(nodes + 1), 9 * starts)


@kernel
def _descend(
    problem: UnevenPathProblem, pattern: Pattern, knots: Array, stages: tuple[Array, Array], iterations: int
) -> float:
    """Minimise from the knots (K, 3), in place; returns how much better the points fit then.

    `stages` are the widenings (n,) and the tolerances (n,). The pattern has the knots in order.
    """
    widenings, tolerances = stages
    here, there = _empty_system(pattern, knots), _empty_system(pattern, knots)
    _evaluate(problem, pattern.starts, knots, widenings[-1], here)
    before = here.terms[FIT]
    for stage in range(len(widenings)):
        _descend_stage(problem, pattern, knots, widenings[stage], tolerances[stage], iterations, here, there)
    return float(before - here.terms[FIT])


@kernel
def _empty_system(pattern: Pattern, knots: Array) -> UnevenPathSystem:
    return UnevenPathSystem(np.empty(3), np.empty_like(knots), np.empty((len(pattern.rows), 3, 3)))


@kernel
def _descend_stage(
    problem: UnevenPathProblem,
    pattern: Pattern,
    knots: Array,
    widening: float,
    tolerance: float,
    iterations: int,
    here: UnevenPathSystem,
    there: UnevenPathSystem,
) -> None:
    """Minimise from the knots (K, 3), in place, after Levenberg and Marquardt. Writes the energy `here`."""
    damped, diagonal = np.empty_like(here.hessian), np.empty_like(knots)
    trial, damping = np.empty_like(knots), PAIRWISE_STEPS.first
    step, gathered = np.empty(knots.size), np.empty(knots.size)
    _evaluate(problem, pattern.starts, knots, widening, here)
    for _ in range(iterations):
        assign(damped.reshape(-1), here.hessian.reshape(-1))
        for k in range(knots.shape[0]):
            for a in range(3):
                damped[pattern.starts[k], a, a] *= 1.0 + damping
                diagonal[k, a] = damped[pattern.starts[k], a, a]
        loose = np.zeros(knots.shape, dtype=np.bool_)
        panels = factorise_blocks(pattern, damped, diagonal, loose)
        accepted = False
        if not loose.any():
            assign(step, here.gradient.reshape(-1))
            solve_lower(pattern, panels, step, gathered)
            solve_upper(pattern, panels, step, gathered)
            for k in range(knots.size):
                trial.reshape(-1)[k] = knots.reshape(-1)[k] - step[k]
            _evaluate(problem, pattern.starts, trial, widening, there)
            accepted = is_accepted(here.terms.sum(), there.terms.sum(), PAIRWISE_STEPS)
            if accepted:
                assign_rows(knots, trial)
                assign(here.terms, there.terms)
                assign_rows(here.gradient, there.gradient)
                assign(here.hessian.reshape(-1), there.hessian.reshape(-1))
            if is_last(np.abs(step).max(), tolerance, damping, PAIRWISE_STEPS):
                break
        damping = next_damping(damping, accepted, PAIRWISE_STEPS)
        if damping > PAIRWISE_STEPS.greatest:
            break


@kernel
def _evaluate(
    problem: UnevenPathProblem, starts: Indices, knots: Array, widening: float, found: UnevenPathSystem
) -> None:
    """Write the energy at the knots (K, 3). `starts` (K + 1,) are those of the pattern's columns."""
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
        _seen_from_group(problem.points[begin:end], problem.shares[begin:end], after, step, pose[2], moved)
        evaluate_energy(
            problem.grid, problem.half, moved[: end - begin], pose, widening, 0.0, 0.0, 1, buffers, out
        )
        terms[FIT] += problem.scale * out[0]
        first, second = starts[part], starts[part + 1]
        at = 4
        for a in range(3):
            gradient[part, a] += before * problem.scale * out[1 + a]
            gradient[part + 1, a] += after * problem.scale * out[1 + a]
            for b in range(a, 3):
                block[a, b] = block[b, a] = problem.scale * out[at]
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
    points: Array, shares: Array, at: float, step: Array, heading: float, out: Array
) -> None:
    """Write points (m, 2) from the pose of their group, at a share of the step (3,) of their part.

    They were seen at the `shares` (m,) of it. Within a part the chord is as good as the arc.
    """
    cos, sin = np.cos(heading), np.sin(heading)
    ahead, aside = cos * step[0] + sin * step[1], cos * step[1] - sin * step[0]
    for k in range(points.shape[0]):
        share = shares[k] - at
        # The series are exact to 1e-12 at half a radian.
        turn = share * step[2]
        t = turn * turn
        c = 1.0 - t / 2.0 * (1.0 - t / 12.0 * (1.0 - t / 30.0 * (1.0 - t / 56.0 * (1.0 - t / 90.0))))
        s = turn * (1.0 - t / 6.0 * (1.0 - t / 20.0 * (1.0 - t / 42.0 * (1.0 - t / 72.0))))
        out[k, 0] = c * points[k, 0] - s * points[k, 1] + share * ahead
        out[k, 1] = s * points[k, 0] + c * points[k, 1] + share * aside


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
