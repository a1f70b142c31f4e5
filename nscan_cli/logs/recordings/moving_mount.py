"""A laser on transforms that move: what it is mounted like on the whole, or why no map can be made of it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.logs.recordings.tf_chains import Pair, Timed, inverse_transform
from nscan_cli.poses import Array, wrap

MOST_ROCKING = math.radians(5.0)
"""A laser that is tilted by less rocks with its robot, as a stabiliser tells; by more, it nods."""
MOST_TURNING = math.radians(1.0)
"""From the mean; a laser that is turned by more pans. Rocking by 5° both ways seems to turn by 0.4°."""
MOST_SLIDING = 0.1
"""m from the mean; rocking by 5° shifts a laser 1 m above its axis by 0.09 m."""

LEAST_SAID = 0.001
"""m"""
AT_ANY_TIME = np.zeros(1, dtype=np.int64)
"""The one time of a fixed transform."""


@dataclass(frozen=True)
class Link:
    """One transform of a chain, over time."""

    name: str
    timed: Timed
    """At one time only, if it is fixed."""

    @property
    def moves(self) -> bool:
        """Whether it is none that is fixed."""
        return len(self.timed.times) > 1


@dataclass(frozen=True)
class Course:
    """Where a laser is on its robot, over time."""

    poses: Array
    """(n, 4, 4), n > 1, at the times when something moves."""

    @property
    def hangs(self) -> bool:
        """Whether it is mostly upside down."""
        return bool(np.median(self.poses[:, 2, 2]) < 0)

    @property
    def tilts(self) -> Array:
        """(n,) rad between the laser's axis and the vertical, either way up; up to π where it turns over."""
        up = self.poses[:, 2, 2] * (-1 if self.hangs else 1)
        return np.arccos(np.clip(up, -1.0, 1.0))

    @property
    def turns(self) -> Array:
        """(n,) rad about the vertical, from the mean."""
        return np.asarray(wrap(self._yaws - self.mount[2]))

    @property
    def shifts(self) -> Array:
        """(n,) m seen from above, from the mean."""
        away: Array = np.hypot(*(self.poses[:, :2, 3] - self.mount[:2]).T)
        return away

    @property
    def mount(self) -> Array:
        """(3,) the mean of the laser's mounting, seen from above."""
        yaws = self._yaws
        yaw = math.atan2(np.sin(yaws).mean(), np.cos(yaws).mean())
        x, y = self.poses[:, :2, 3].mean(axis=0)
        mount: Array = np.round(np.array([x, y, yaw]), 9) + 0.0
        return mount

    @property
    def _yaws(self) -> Array:
        yaws: Array = np.arctan2(self.poses[:, 1, 0], self.poses[:, 0, 0])
        return yaws

    @property
    def nods(self) -> bool:
        """Whether it is tilted by more than a robot rocks."""
        return bool(self.tilts.max() >= MOST_ROCKING)

    def extent(self) -> str:
        """How far a laser moves that rocks."""
        rising = float(np.ptp(self.poses[:, 2, 3]))
        rises = f" and rises by {rising:.3f} m" if rising >= LEAST_SAID else ""
        return f"so that it tilts by up to {math.degrees(self.tilts.max()):.1f}°{rises}"

    def unfit(self) -> str:
        """Why no map can be made of such a laser's scans, what it does and how far; empty when one can."""
        if self.nods:
            return self._nodding()
        if np.abs(self.turns).max() > MOST_TURNING:
            low, high = self._span(self._yaws)
            return "pans" + (_round(low, high) or f", from {low:.1f}° to {high:.1f}°")
        if self.shifts.max() > MOST_SLIDING:
            return f"slides, by up to {self.shifts.max():.2f} m to either side"
        return ""

    def _nodding(self) -> str:
        """About its y axis where that stays level, else about its x axis."""
        sign = -1 if self.hangs else 1
        ahead, aside = self.poses[:, 2, 0], self.poses[:, 2, 1]
        nods = float(np.ptp(ahead)) >= float(np.ptp(aside))
        angles = np.arctan2(ahead if nods else aside, sign * self.poses[:, 2, 2])
        low, high = self._span(angles)
        if nods:
            return "nods" + (_round(low, high) or f", from {_up(low)} to {_up(high)}")
        return "rolls" + (_round(low, high) or f", from {low:.1f}° to {high:.1f}°")

    @staticmethod
    def _span(angles: Array) -> tuple[float, float]:
        """Degrees."""
        there = np.degrees(np.unwrap(angles))
        return float(there.min()) + 0.0, float(there.max()) + 0.0


def links(names: Sequence[str], fixed: Mapping[Pair, Array], moving: Mapping[Pair, Timed]) -> list[Link]:
    """The transforms of a chain of frames, each in the direction of the chain."""
    found = []
    for ends in itertools.pairwise(names):
        pair = ends if ends in fixed or ends in moving else ends[::-1]
        timed = Timed(AT_ANY_TIME, fixed[pair][None]) if pair in fixed else moving[pair]
        if pair != ends:
            timed = timed._replace(poses=inverse_transform(timed.poses))
        found.append(Link(" → ".join(pair), timed))
    return found


def at_rest(chain: Sequence[Link]) -> Array:
    """Where the last frame of a chain of fixed transforms is in the first (4, 4)."""
    there: Array = np.eye(4)
    for link in chain:
        there = there @ link.timed.poses[0]
    return there


def course(chain: Sequence[Link]) -> Course | None:
    """Where the last frame of a chain is in the first; None when nothing moves.

    At a time between two poses of a transform, the earlier one holds.
    """
    movers = [link for link in chain if link.moves]
    if not movers:
        return None
    times = movers[0].timed.times
    if len(movers) > 1:
        times = np.unique(np.concatenate([link.timed.times for link in movers]))
    there: Array = np.broadcast_to(np.eye(4), (len(times), 4, 4))
    for link in chain:
        rows = np.searchsorted(link.timed.times, times, side="right") - 1
        there = there @ link.timed.poses[np.maximum(rows, 0)]
    return Course(there)


def _round(low: float, high: float) -> str:
    """What a turn that does not end is called; empty for one that does. Degrees."""
    return " round and round" if high - low >= 360 else ""


def _up(angle: float) -> str:
    """An angle (degrees) against the level."""
    return "level" if abs(angle) < 0.05 else f"{abs(angle):.1f}° {'up' if angle > 0 else 'down'}"
