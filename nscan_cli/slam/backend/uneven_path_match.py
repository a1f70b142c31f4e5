"""The match of a path along which a laser sweeps: the knots between which its beams fit best.

A few damped Newton steps, first with widened Gaussians and a part of the points, then with all.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import factorise_blocks, solve_lower, solve_upper
from nscan_cli.graph.linalg.factor_pattern import Pattern
from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.damped_newton import PAIRWISE_STEPS, is_accepted, is_last, next_damping
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.backend.options import UnevenMotionOptions
from nscan_cli.slam.backend.uneven_path_energy import (
    FIT,
    UnevenPathProblem,
    UnevenPathSystem,
    evaluate_uneven_path,
)


class TimedPoints(NamedTuple):
    """Points that a laser saw one after another."""

    points: Array
    """(m, 2) points in the robot's frame, each from where it was then."""
    times: Array
    """(m,) s; increasing."""


class PathStages(NamedTuple):
    """The n stages of a match."""

    widenings: Array
    """(n,) the w of the energy."""
    tolerances: Array
    """(n,) a stage has ended when no knot moves by more, m and rad."""
    strides: Indices
    """(n,) one point in so many is matched."""


def match_uneven_path(
    reference: Ndt, seen: TimedPoints, times: Array, start: Array, options: UnevenMotionOptions
) -> tuple[Array, float]:
    """The knots (K, 3), at `times` (K,), s, between which points `seen` fit a reference best.

    Also returns how much better they fit there than at the knots `start` (K, 3), K ≥ 3, whose φ does not jump
    by 2π. One in `options.parts` of these is a pose that is known. Points are seen from the first to the last
    of the times. Each stage ends with a step that moves no knot by more than its tolerance.
    """
    seconds, groups = np.diff(times), options.groups
    part = np.searchsorted(times, seen.times, side="right") - 1
    shares = (seen.times - times[part]) / seconds[part]
    group = groups * part + np.minimum((groups * shares).astype(np.int64), groups - 1)
    ends = np.searchsorted(group, np.arange(groups * len(seconds) + 1))
    sigmas = np.array([options.sigma, options.turn_sigma, options.speed_change, options.turn_change])
    problem = UnevenPathProblem(
        reference.grid, reference.half, seen.points, shares, ends, groups, seconds, start, options.parts,
        options.scale, sigmas,
    )  # fmt: skip
    knots, coarse = start.copy(), len(options.widenings) - 1
    stages = PathStages(
        np.array(options.widenings),
        np.array([options.coarse_tolerance] * coarse + [options.tolerance]),
        np.array([options.coarse_stride] * coarse + [1]),
    )
    gain = _descend(problem, _band_pattern(len(times)), knots, stages, options.iterations)
    return knots, gain


@functools.cache
def _band_pattern(nodes: int) -> Pattern:
    """The pattern of the factor where each of at least 3 nodes has blocks with the next two, in order."""
    columns = np.arange(nodes)
    heights = np.minimum(3, nodes - columns)
    starts = np.concatenate([[0], np.cumsum(heights)])
    rows = np.arange(starts[-1]) - np.repeat(starts[:-1] - columns, heights)
    return Pattern(columns, starts, rows, np.arange(nodes + 1), 9 * starts)


@kernel
def _descend(
    problem: UnevenPathProblem, pattern: Pattern, knots: Array, stages: PathStages, iterations: int
) -> float:
    """Minimise from the knots (K, 3), in place; returns how much better the points fit then.

    The pattern has the knots in order.
    """
    last = len(stages.widenings) - 1
    here, there = _empty_system(pattern, knots), _empty_system(pattern, knots)
    evaluate_uneven_path(problem, pattern.starts, knots, stages.widenings[last], stages.strides[last], here)
    before = here.terms[FIT]
    for stage in range(last + 1):
        _descend_stage(problem, pattern, knots, stages, stage, iterations, here, there)
    return float(before - here.terms[FIT])


@kernel
def _empty_system(pattern: Pattern, knots: Array) -> UnevenPathSystem:
    return UnevenPathSystem(np.empty(3), np.empty_like(knots), np.empty((len(pattern.rows), 3, 3)))


@kernel
def _descend_stage(
    problem: UnevenPathProblem,
    pattern: Pattern,
    knots: Array,
    stages: PathStages,
    stage: int,
    iterations: int,
    here: UnevenPathSystem,
    there: UnevenPathSystem,
) -> None:
    """Minimise from the knots (K, 3), in place, after Levenberg and Marquardt. Writes the energy `here`."""
    widening, stride = stages.widenings[stage], stages.strides[stage]
    damped, diagonal = np.empty_like(here.hessian), np.empty_like(knots)
    trial, damping = np.empty_like(knots), PAIRWISE_STEPS.first
    step, gathered = np.empty(knots.size), np.empty(knots.size)
    evaluate_uneven_path(problem, pattern.starts, knots, widening, stride, here)
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
            evaluate_uneven_path(problem, pattern.starts, trial, widening, stride, there)
            accepted = is_accepted(here.terms.sum(), there.terms.sum(), PAIRWISE_STEPS)
            if accepted:
                assign_rows(knots, trial)
                assign(here.terms, there.terms)
                assign_rows(here.gradient, there.gradient)
                assign(here.hessian.reshape(-1), there.hessian.reshape(-1))
            if is_last(np.abs(step).max(), stages.tolerances[stage], damping, PAIRWISE_STEPS):
                break
        damping = next_damping(damping, accepted, PAIRWISE_STEPS)
        if damping > PAIRWISE_STEPS.greatest:
            break
