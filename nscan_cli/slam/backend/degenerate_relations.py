"""Where no scan tells how far the robot went, along bare walls without odometry, and the relations there.

Tracking assumes steady motion there. If the robot went faster or slower meanwhile, the way is too long or
too short, every match fits, and nothing contradicts. The Hessian of a match there describes only the ripple
of its energy. So the relations of such a way get variance along it: that of a random walk, whose end has the
variance of the whole guess. All relations there repeat the same guess, and marginals count each pair of scans
once.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Array, Indices, Mask, path_lengths
from nscan_cli.slam.backend.options import DegenerateRelationOptions, DegenerateStretchOptions
from nscan_cli.slam.frontend.odometry_checks import SHORTEST_PERIOD
from nscan_cli.slam.state import SlamState


class DegenerateStretch(NamedTuple):
    """A stretch of the path."""

    first: int
    """Row of its first scan."""
    last: int
    """Row of its last scan."""
    path: float
    """Length of the stretch as mapped, m."""
    possible: float
    """Length of the stretch at the robot's usual speed, m: it may only seem to stand."""

    def is_long(self, options: DegenerateStretchOptions) -> bool:
        """Whether it is long as mapped."""
        return self.path >= options.path


def degenerate_stretches(
    poses: Array, times: Array, weakest_sigmas: Array, options: DegenerateStretchOptions
) -> list[DegenerateStretch]:
    """The stretches of `options.path` or more, as mapped or at the robot's usual speed.

    The scans are at poses (S, 3) and times (S,), s, and tell their places to `weakest_sigmas` (S,), m.
    """
    rows = np.flatnonzero(weakest_sigmas > options.sigma)
    if not len(rows):
        return []
    along = path_lengths(poses)
    pieces = np.split(rows, np.flatnonzero(np.diff(rows) > options.scans_between + 1) + 1)
    speed, ways = usual_speed(poses, times, weakest_sigmas <= options.sigma, options.least_speed), []
    for piece in pieces:
        begin, last = max(int(piece[0]) - 1, 0), int(piece[-1])
        possible = speed * float(times[last] - times[begin])
        way = DegenerateStretch(int(piece[0]), last, float(along[last] - along[begin]), possible)
        if max(way.path, way.possible) >= options.path:
            ways.append(way)
    return ways


def usual_speed(poses: Array, times: Array, is_told: Mask, least_speed: float) -> float:
    """The median speed (m/s) along a path (S, 3) of a robot that moves, where it `is_told` (S,).

    The poses are at times (S,), s. A slower robot than `least_speed` (m/s) stands. 0 if it never moves.
    """
    speeds = np.hypot(*np.diff(poses[:, :2], axis=0).T) / np.maximum(np.diff(times), SHORTEST_PERIOD)
    moves = speeds > least_speed
    told = moves & is_told[1:]
    chosen = told if told.any() else moves
    return float(np.median(speeds[chosen])) if chosen.any() else 0.0


Between = list[tuple[int, int]]
"""For each two successive nodes of a relation, the first and the last step from keyframe to keyframe between
them."""


def widened_relations(state: SlamState) -> tuple[list[Pairwise], list[NScan]]:
    """The pairwise and the nScan relations, as certain as scans tell the way."""
    pairwise, nscan = state.pairwise_relations, state.nscan_relations
    variances = guess_variances(state)
    if not variances.any():
        return pairwise, nscan
    most = state.options.degenerate_relations.most_steps
    already = {id(relation) for relation in state.saved_relations}
    widened = with_guess_variances(pairwise, nscan, state.route.rows, variances, most)
    pairs = [old if id(old) in already else new for old, new in zip(pairwise, widened[0], strict=True)]
    return pairs, [old if id(old) in already else new for old, new in zip(nscan, widened[1], strict=True)]


def guess_variances(state: SlamState) -> Array:
    """The variances (K − 1, 3) of what is guessed from each keyframe to the next: along the way (m²), and,
    where scans fit nothing, of place (m²) and of turn (rad²).

    Those of tracking; of a saved graph those that it has.
    """
    if not state.weakest_sigmas:
        return state.saved_guesses if len(state.saved_guesses) else np.zeros((len(state.route.rows) - 1, 3))
    # Scans after the last keyframe may be tracked by another thread at this moment.
    end = int(state.route.rows[-1]) + 1
    path, sigmas = np.concatenate(list(state.tracked))[:end], np.concatenate(list(state.weakest_sigmas))[:end]
    times, rows, options = state.log.times[:end], state.route.rows, state.options.degenerate_relations
    found = degenerate_stretches(path, times, sigmas, options.stretch)
    # A robot that seems to stand mostly does.
    ways = [way for way in found if way.is_long(options.stretch)]
    lost = [keyframe.guess_variances for keyframe in state.route.keyframes[1 : len(rows)]]
    return np.column_stack(
        [length_variances(rows, times, ways, options), np.array(lost).reshape(len(rows) - 1, 2)]
    )


def all_widened_relations(state: SlamState) -> list[Relation]:
    """All relations, in the order of the graph, as certain as scans tell the way."""
    pairwise, nscan = widened_relations(state)
    return [*pairwise, *nscan, *state.other_relations]


def length_variances(
    rows: Indices, times: Array, ways: Sequence[DegenerateStretch], options: DegenerateRelationOptions
) -> Array:
    """The variance (K − 1,) in m² of the guess from each of the keyframes in rows (K,) to the next.

    `times` (S,) are those of all scans, s.
    """
    variances = np.zeros(max(len(rows) - 1, 0))
    at = times[rows]
    for way in ways:
        begin, end = times[max(way.first - 1, 0)], times[way.last]
        whole = options.speed_share * way.possible
        within = np.clip(at[1:], begin, end) - np.clip(at[:-1], begin, end)
        variances += whole**2 * within / max(float(end - begin), 1e-9)
    return variances


def with_guess_variances(
    pairwise: Sequence[Pairwise], nscan: Sequence[NScan], rows: Indices, variances: Array, most_steps: int
) -> tuple[list[Pairwise], list[NScan]]:
    """The relations among keyframes in rows (K,), less certain along ways that no scan tells.

    `variances` (K − 1, 3) are those from each keyframe to the next: along the way (m²), and, where scans fit
    nothing, of place (m²) and of turn (rad²). Relations over more than `most_steps` keyframes are of another
    visit: they measure, and stay.
    """
    known = [_widened_pair(pair, _steps(pair, rows, most_steps), variances) for pair in pairwise]
    return known, [_widened_joint(joint, _steps(joint, rows, most_steps), variances) for joint in nscan]


def _steps(relation: Pairwise | NScan, rows: Indices, most_steps: int) -> Between:
    """The steps of the chain between successive nodes of a relation; an empty range where it is a loop."""
    at = np.sort(np.searchsorted(rows, np.array(relation.nodes))).tolist()
    return [(a, b if b - a <= most_steps else a) for a, b in itertools.pairwise(at)]


def _widened_pair(pair: Pairwise, steps: Between, variances: Array) -> Pairwise:
    ((first, last),) = steps
    along, place, turn = variances[first:last].sum(axis=0).tolist()
    if along + place + turn == 0.0:
        return pair
    direction = np.append(_direction(pair.measurement[:2], pair.measurement[2]), 0.0)
    information = _less_certain(pair.information, direction, along)
    for axis, variance in zip(np.eye(3), (place, place, turn), strict=True):
        information = _less_certain(information, axis, variance)
    return replace(pair, information=information)


def _widened_joint(joint: NScan, steps: Between, variances: Array) -> NScan:
    order = np.argsort(joint.nodes)
    poses, hessian = joint.poses[order], joint.hessian
    for after, (first, last) in enumerate(steps, start=1):
        along, place, turn = variances[first:last].sum(axis=0).tolist()
        if along + place + turn == 0.0:
            continue
        direction = _direction(poses[after, :2] - poses[after - 1, :2], poses[after, 2])
        # The scans behind the step move along it together, or turn about its end.
        off = poses[after:, :2] - poses[after, :2]
        for motion, variance in (
            (np.append(direction, 0.0), along),
            (np.array([1.0, 0.0, 0.0]), place),
            (np.array([0.0, 1.0, 0.0]), place),
            (np.column_stack([-off[:, 1], off[:, 0], np.ones(len(off))]), turn),
        ):
            motions = np.zeros((len(order), 3))
            motions[order[after:]] = motion
            hessian = _less_certain(hessian, motions.ravel(), variance)
    return joint if hessian is joint.hessian else replace(joint, hessian=hessian)


def _direction(step: Array, heading: float) -> Array:
    """The unit vector (2,) along a step (2,), or along a heading (rad) if it is of no length."""
    length = float(np.hypot(*step))
    return step / length if length > 1e-3 else np.array([np.cos(heading), np.sin(heading)])


def _less_certain(information: Array, motion: Array, variance: float) -> Array:
    """Information (n, n) with a variance added along a motion (n,): Sherman and Morrison's formula."""
    row = information @ motion
    return information - np.outer(row, row) * (variance / (1.0 + variance * float(motion @ row)))
