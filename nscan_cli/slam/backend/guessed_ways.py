"""Relations along ways that are guessed are as uncertain as the guess, and have its length.

All relations of one visit repeat the guess of the chain there. What a match says of the length is no more
than the ripple of its energy, or a pull: scans cover more of each other the nearer they are, so a joint match
draws a bare corridor together. So each such relation gets the length of the chain, and its variance.

The direction of the way is guessed, too. Relations whose variance lies along directions that differ by a
milliradian cross like needles: together they would know the length to some metres, however long it is. So
they also get some variance across.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.poses import Array, Indices, Mask, compose
from nscan_cli.slam.backend.options import DegenerateRelationOptions


class _Guess(NamedTuple):
    """What is guessed of the way between two keyframes."""

    way: Array | None
    """(2,) m, in the frame of the first keyframe; None if no length is guessed, or a relation does not have
    it from the chain."""
    angle: float
    """The direction of its least certain step, rad, in that frame."""
    along: float
    """Variance along the way, m²."""
    place: float
    """Variance of the place, m², where scans fit nothing."""
    turn: float
    """Variance of the turn, rad², there."""


class GuessedWays(NamedTuple):
    """What is guessed along the chain of keyframes."""

    rows: Indices
    """(K,) rows of the keyframes."""
    chain: Sequence[Pairwise]
    """The relations from each keyframe to the next."""
    variances: Array
    """(K − 1, 3) variances of each of these steps: along the way (m²), and, where scans fit nothing, of place
    (m²) and of turn (rad²)."""
    options: DegenerateRelationOptions

    def widened_pair(self, pair: Pairwise) -> Pairwise:
        """The relation of two keyframes, as certain as scans tell the way between them."""
        (guess,) = self._between(sorted(pair.nodes))
        if not _is_guessed(guess):
            return pair
        measurement = pair.measurement
        direction = _unit(measurement[2] if guess.way is None else guess.angle)
        if guess.way is not None:
            measurement = measurement.copy()
            measurement[:2] += _missing(guess.way - measurement[:2], direction)
        information = pair.information
        for motion, variance in self._along(direction, guess.along):
            information = _less_certain(information, motion, variance)
        for axis, variance in zip(np.eye(3), (guess.place, guess.place, guess.turn), strict=True):
            information = _less_certain(information, axis, variance)
        return replace(pair, measurement=measurement, information=information)

    def widened_joint(self, joint: NScan) -> NScan:
        """The relation of several keyframes, as certain as scans tell the ways between them."""
        order = np.argsort(joint.nodes)
        poses, hessian = joint.poses[order], joint.hessian
        guesses = self._between(np.array(joint.nodes)[order])
        for after, guess in enumerate(guesses, start=1):
            if not _is_guessed(guess):
                continue
            behind = order[after:]
            if guess.way is None:
                direction = _unit(poses[after, 2])
            else:
                way = _turned(guess.way, poses[after - 1, 2])
                direction = _unit(poses[after - 1, 2] + guess.angle)
                moved = _missing(way - (poses[after, :2] - poses[after - 1, :2]), direction)
                poses = poses + np.append(moved, 0.0) * (np.arange(len(order)) >= after)[:, None]
                hessian = _moved_hessian(hessian, behind, moved)
            # The scans behind the step move along it together, or turn about its end.
            off = poses[after:, :2] - poses[after, :2]
            for motion, variance in (
                *self._along(direction, guess.along),
                (np.array([1.0, 0.0, 0.0]), guess.place),
                (np.array([0.0, 1.0, 0.0]), guess.place),
                (np.column_stack([-off[:, 1], off[:, 0], np.ones(len(off))]), guess.turn),
            ):
                motions = np.zeros((len(order), 3))
                motions[behind] = motion
                hessian = _less_certain(hessian, motions.ravel(), variance)
        if hessian is joint.hessian:
            return joint
        return replace(joint, poses=poses[np.argsort(order)], hessian=hessian)

    def _between(self, nodes: Sequence[int] | Indices) -> list[_Guess]:
        """What is guessed between successive nodes, which are in order."""
        at = np.searchsorted(self.rows, np.asarray(nodes))
        lost = self._are_lost(at)
        return [
            self._guess(int(at[k - 1]), int(at[k]), bool(lost[:k].all() or lost[k:].all()))
            for k in range(1, len(at))
        ]

    def _are_lost(self, at: Indices) -> Mask:
        """(n,) which of some keyframes tell no place: the steps to them and from them are guessed."""
        along, last = self.variances[:, 0], len(self.variances)
        to, from_ = along[np.maximum(at - 1, 0)] > 0.0, along[np.minimum(at, last - 1)] > 0.0
        found: Mask = (to | (at == 0)) & (from_ | (at == last))
        return found

    def _guess(self, a: int, b: int, is_lost: bool) -> _Guess:
        """What is guessed from keyframe a to b; `is_lost` says that all scans on one side tell no place."""
        along, place, turn = self.variances[a:b].sum(axis=0).tolist()
        if b - a > self.options.most_steps:
            # Another visit is measured, unless scans tell no place: then any match fits.
            return _Guess(None, 0.0, self.options.revisit_factor * along if is_lost else 0.0, 0.0, 0.0)
        if along == 0.0:
            return _Guess(None, 0.0, along, place, turn)
        way, angle, least = np.zeros(3), 0.0, a + int(np.argmax(self.variances[a:b, 0]))
        for k in range(a, b):
            step = self.chain[k].measurement
            if k == least:
                # The two ends of a short step tell no direction, but the robot looks along the walls.
                is_short = float(np.hypot(*step[:2])) < self.options.direction_length
                angle = float(way[2]) + (0.0 if is_short else float(np.arctan2(step[1], step[0])))
            way = compose(way, step)
        return _Guess(way[:2], angle, along, place, turn)

    def _along(self, direction: Array, variance: float) -> list[tuple[Array, float]]:
        """The motions (3,) with a variance (m²) along a direction (2,), which itself is not certain."""
        x, y = direction
        across = variance * self.options.direction_sigma**2
        return [(np.array([x, y, 0.0]), variance), (np.array([-y, x, 0.0]), across)]


def _is_guessed(guess: _Guess) -> bool:
    return guess.along + guess.place + guess.turn > 0.0


def _missing(difference: Array, direction: Array) -> Array:
    """The part (2,) of a difference (2,) along a direction (2,)."""
    part: Array = float(difference @ direction) * direction
    return part


def _turned(vector: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def _unit(angle: float) -> Array:
    """The unit vector (2,) in a direction, rad."""
    return np.array([np.cos(angle), np.sin(angle)])


def _moved_hessian(hessian: Array, scans: Indices, moved: Array) -> Array:
    """The Hessian (3n, 3n) of a joint match some of whose scans are `moved` (2,) without turning.

    Its gauge moves with them: what was measured at their former places turns with each of them.
    """
    n = len(hessian) // 3
    former = np.eye(3 * n)
    former[3 * scans, 3 * scans + 2] = moved[1]
    former[3 * scans + 1, 3 * scans + 2] = -moved[0]
    found: Array = former.T @ hessian @ former
    return found


def _less_certain(information: Array, motion: Array, variance: float) -> Array:
    """Information (n, n) with a variance added along a motion (n,): Sherman and Morrison's formula."""
    row = information @ motion
    return information - np.outer(row, row) * (variance / (1.0 + variance * float(motion @ row)))
