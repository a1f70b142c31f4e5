"""A laser on transforms that move: what it is mounted like on the whole, or why no map can be made of it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.frames import Pair, as_matrices, inverse
from nscan_cli.logs.sensed import Rigid
from nscan_cli.poses import Array, wrap

MOST_ROCKING = math.radians(5.0)
"""A laser that is tilted by less rocks with its robot, as a stabiliser tells; by more, it nods."""
MOST_TURNING = math.radians(1.0)
"""From the mean; a laser that is turned by more pans. Rocking by 5° both ways seems to turn by 0.4°."""
MOST_SLIDING = 0.1
"""m from the mean; rocking by 5° shifts a laser 1 m above its axis by 0.09 m."""

LEAST_SAID = 0.001
"""m"""
Timed = tuple[int, Rigid]
"""A pose and its time (ns)."""


@dataclass(frozen=True)
class Link:
    """One transform of a chain, over time."""

    name: str
    times: NDArray[np.int64]
    """(n,) ns, increasing; one of a fixed transform."""
    poses: Array
    """(n, 4, 4)"""

    @property
    def moves(self) -> bool:
        """Whether it is none that is fixed."""
        return len(self.times) > 1


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


def links(
    names: Sequence[str], fixed: Mapping[Pair, Array], moving: Mapping[Pair, Sequence[Timed]]
) -> list[Link]:
    """The transforms of a chain of frames, each in the direction of the chain."""
    found = []
    for start, end in itertools.pairwise(names):
        pair = (start, end) if (start, end) in fixed or (start, end) in moving else (end, start)
        if pair in fixed:
            times, poses = np.zeros(1, dtype=np.int64), fixed[pair][None]
        else:
            times, poses = over_time(moving[pair])
        found.append(Link(f"{pair[0]} → {pair[1]}", times, poses if pair == (start, end) else inverse(poses)))
    return found


def over_time(poses: Sequence[Timed]) -> tuple[NDArray[np.int64], Array]:
    """Times (n,) and matrices (n, 4, 4) of poses with their times (ns), in order of time."""
    times = np.array([time for time, _ in poses], dtype=np.int64)
    good, matrices = as_matrices([pose for _, pose in poses])
    order = np.argsort(times[good], kind="stable")
    return times[good][order], matrices[order]


def course(chain: Sequence[Link]) -> Course | None:
    """Where the last frame of a chain is in the first; None when nothing moves.

    At a time between two poses of a transform, the earlier one holds.
    """
    movers = [link for link in chain if link.moves]
    if not movers:
        return None
    times = (
        movers[0].times if len(movers) == 1 else np.unique(np.concatenate([link.times for link in movers]))
    )
    there: Array = np.broadcast_to(np.eye(4), (len(times), 4, 4))
    for link in chain:
        there = there @ link.poses[np.maximum(np.searchsorted(link.times, times, side="right") - 1, 0)]
    return Course(there)


def _round(low: float, high: float) -> str:
    """What a turn that does not end is called; empty for one that does. Degrees."""
    return " round and round" if high - low >= 360 else ""


def _up(angle: float) -> str:
    """An angle (degrees) against the level."""
    return "level" if abs(angle) < 0.05 else f"{abs(angle):.1f}° {'up' if angle > 0 else 'down'}"
