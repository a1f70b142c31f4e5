"""A laser whose mounting moves on the robot (tf): its mean pose, or why no map can be made of its scans."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.logs.recordings.poses_3d import rounded_mount
from nscan_cli.logs.recordings.tf_chains import ChainLink, composed
from nscan_cli.poses import Array, wrap

SHOWN_RISE = 0.001
"""m; a message leaves out a smaller vertical motion."""


@dataclass(frozen=True)
class MountingOptions:
    """How far a laser may be from level and at rest."""

    tilt: float = math.radians(1.0)
    """Largest tilt of a laser that does not move, rad. A larger value accepts more recordings and worse
    scans."""
    rocking: float = math.radians(5.0)
    """Largest tilt of a laser that moves, rad: a stabiliser reports how the robot rocks. Beyond, it nods. A
    larger value accepts more recordings and worse scans."""
    turn: float = math.radians(1.0)
    """Largest rotation about the vertical from the mean, rad. Rocking by 5° both ways causes 0.4°. A larger
    value accepts more recordings and worse scans."""
    shift: float = 0.1
    """Largest horizontal shift from the mean, m. Rocking by 5° shifts a laser 1 m above its axis by 0.09 m. A
    larger value accepts more recordings and worse scans."""
    fixed_tolerance: float = 1e-6
    """A transform is fixed if its coordinates (m) and its quaternion change by no more. A larger value takes
    more lasers for fixed."""


@dataclass(frozen=True)
class MovingMount:
    """The poses of a laser on its robot, over time."""

    poses: Array
    """(n, 4, 4), n > 1"""

    @property
    def hangs(self) -> bool:
        """Whether the laser is upside down most of the time."""
        return bool(np.median(self.poses[:, 2, 2]) < 0)

    @property
    def tilts(self) -> Array:
        """(n,) rad between the laser's axis and the vertical, either way up; up to π where it turns over."""
        up = self.poses[:, 2, 2] * (-1 if self.hangs else 1)
        return np.arccos(np.clip(up, -1.0, 1.0))

    @property
    def mount(self) -> Array:
        """(3,) mean pose of the laser, seen from above."""
        yaw = math.atan2(np.sin(self._yaws).mean(), np.cos(self._yaws).mean())
        x, y = self.poses[:, :2, 3].mean(axis=0)
        return rounded_mount(x, y, yaw)

    @property
    def _yaws(self) -> Array:
        yaws: Array = np.arctan2(self.poses[:, 1, 0], self.poses[:, 0, 0])
        return yaws

    @property
    def nods(self) -> bool:
        """Whether it is tilted by more than a robot rocks."""
        return bool(self.tilts.max() >= MountingOptions.rocking)

    def extent(self) -> str:
        """How far a laser moves that rocks, as the end of a sentence."""
        rise = float(np.ptp(self.poses[:, 2, 3]))
        rises = f" and rises by {rise:.3f} m" if rise >= SHOWN_RISE else ""
        return f"so that it tilts by up to {math.degrees(self.tilts.max()):.1f}°{rises}"

    def problem(self) -> str:
        """Why no map can be made of the scans, as the predicate of "the laser …"; empty when one can."""
        if self.nods:
            return self._nodding()
        if np.abs(wrap(self._yaws - self.mount[2])).max() > MountingOptions.turn:
            low, high = _degrees_span(self._yaws)
            return "pans" + (_full_turns(low, high) or f", from {low:.1f}° to {high:.1f}°")
        shift = np.hypot(*(self.poses[:, :2, 3] - self.mount[:2]).T).max()
        return f"slides, by up to {shift:.2f} m to either side" if shift > MountingOptions.shift else ""

    def _nodding(self) -> str:
        """A laser nods about its y axis when its x axis tilts most, else it rolls about its x axis."""
        sign = -1 if self.hangs else 1
        ahead, aside = self.poses[:, 2, 0], self.poses[:, 2, 1]
        nods = float(np.ptp(ahead)) >= float(np.ptp(aside))
        low, high = _degrees_span(np.arctan2(ahead if nods else aside, sign * self.poses[:, 2, 2]))
        if nods:
            return "nods" + (_full_turns(low, high) or f", from {_elevation(low)} to {_elevation(high)}")
        return "rolls" + (_full_turns(low, high) or f", from {low:.1f}° to {high:.1f}°")


def moving_mount(links: Sequence[ChainLink]) -> MovingMount | None:
    """The poses of the last frame of a chain in the first; None when no link moves."""
    return MovingMount(composed(links)) if any(link.moves for link in links) else None


def _degrees_span(angles: Array) -> tuple[float, float]:
    """The least and the greatest of angles (rad) over time, in degrees, without jumps at ±180°."""
    unwrapped = np.degrees(np.unwrap(angles))
    return float(unwrapped.min()) + 0.0, float(unwrapped.max()) + 0.0


def _full_turns(low: float, high: float) -> str:
    """What a rotation over 360° is called; empty for less. Degrees."""
    return " round and round" if high - low >= 360 else ""


def _elevation(angle: float) -> str:
    """An angle (degrees) above the horizon."""
    return "level" if abs(angle) < 0.05 else f"{abs(angle):.1f}° {'up' if angle > 0 else 'down'}"
