"""Where no scan tells how far the robot went, along bare walls without odometry, and the relations there.

Tracking assumes steady motion there. If the robot went faster or slower meanwhile, the way is too long or
too short, every match fits, and nothing contradicts. The Hessian of a match there describes only the ripple
of its energy. So the relations of such a way get variance along it: that of a random walk, whose end has the
variance of the whole guess. The robot may have gone faster or slower than usual, and the farther the mapped
way is from its usual one, the likelier the map is wrong. See guessed_ways.py for what becomes of a relation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.driving_direction import driving_direction
from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Array, Indices, Mask, path_lengths, relative
from nscan_cli.slam.backend.guessed_ways import GuessedWays
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
    ahead: float
    """How far the robot came ahead in it as mapped, m: less than `path` where it seems to reverse."""

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
    is_told = weakest_sigmas <= options.sigma
    speed, ways = usual_speed(poses, times, is_told, options.least_speed), []
    steps = np.append(0.0, np.cumsum(_steps_ahead(poses, times, is_told, options)))
    for piece in pieces:
        begin, last = max(int(piece[0]) - 1, 0), int(piece[-1])
        possible = speed * float(times[last] - times[begin])
        path, ahead = float(along[last] - along[begin]), float(steps[last] - steps[begin])
        way = DegenerateStretch(int(piece[0]), last, path, possible, ahead)
        if max(way.path, way.possible) >= options.path:
            ways.append(way)
    return ways


def _steps_ahead(poses: Array, times: Array, is_told: Mask, options: DegenerateStretchOptions) -> Array:
    """(S − 1,) how far the robot came ahead in each step along a path (S, 3), m.

    Ahead is the way that it drives where the path `is_told` (S,), else all along. A robot that drives there
    in several directions goes ahead in each step.
    """
    shortest = options.least_speed * float(np.median(np.diff(times)))
    ahead = driving_direction(np.where(is_told[:, None], poses, np.nan), shortest, options.min_steps)
    if not ahead.any():
        ahead = driving_direction(poses, shortest, 1)
    steps, length = relative(poses[1:], poses[:-1])[:, :2], float(np.hypot(*ahead))
    found: Array = steps @ (ahead / length) if length > options.min_ahead else np.hypot(*steps.T)
    return found


def usual_speed(poses: Array, times: Array, is_told: Mask, least_speed: float) -> float:
    """The median speed (m/s) along a path (S, 3) of a robot that moves, where it `is_told` (S,).

    The poses are at times (S,), s. A slower robot than `least_speed` (m/s) stands. 0 if it never moves.
    """
    speeds = np.hypot(*np.diff(poses[:, :2], axis=0).T) / np.maximum(np.diff(times), SHORTEST_PERIOD)
    moves = speeds > least_speed
    told = moves & is_told[1:]
    chosen = told if told.any() else moves
    return float(np.median(speeds[chosen])) if chosen.any() else 0.0


def widened_relations(state: SlamState) -> tuple[list[Pairwise], list[NScan]]:
    """The pairwise and the nScan relations, as certain as scans tell the way."""
    pairwise, nscan = state.pairwise_relations, state.nscan_relations
    variances, route = guess_variances(state), state.route
    if not variances.any():
        return pairwise, nscan
    ways = GuessedWays(route.rows, route.chain, variances, state.options.degenerate_relations)
    already = {id(relation) for relation in state.saved_relations}
    pairs = [pair if id(pair) in already else ways.widened_pair(pair) for pair in pairwise]
    return pairs, [joint if id(joint) in already else ways.widened_joint(joint) for joint in nscan]


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
    ways = degenerate_stretches(path, times, sigmas, options.stretch)
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
        whole = float(np.hypot(options.speed_share * way.possible, way.possible - way.ahead))
        within = np.clip(at[1:], begin, end) - np.clip(at[:-1], begin, end)
        variances += whole**2 * within / max(float(end - begin), 1e-9)
    return variances
