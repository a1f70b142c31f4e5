"""Ranges that all are too long or too short by one length bend walls.

On a wall 1/r is a sine of the bearing. With a length added to all ranges it is none: a wall bends, the nearer
the more. So every wall that is seen over a wide angle tells that length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.robot_parts import evenly
from nscan_cli.poses import Array


@dataclass(frozen=True)
class BentWallOptions:
    """When single walls tell a length."""

    half_widths: tuple[float, ...] = (0.4, 0.6)
    """Walls are looked for within these angles on both sides of a beam, rad. Wider ones tell the length more
    precisely, and there are fewer."""
    beams: int = 25
    """Largest number of beams on a wall that are fitted, evenly spread. More take longer."""
    starts: int = 3
    """So many walls are tried within each half width. More take longer."""
    scans: tuple[int, int] = (400, 2500)
    """Numbers of scans that are looked at, evenly spread: the second where the first show few walls."""
    max_nearness: float = 0.8
    """The near half of the walls are at most so far away, as a share of the far half. A larger value decides
    for more logs."""
    max_by_angle: float = 0.17
    """Longest length, as a share of the distances of walls, that may come from an angle between beams that is
    wrong by less than its own check finds. A smaller value decides for more logs."""
    parts: int = 4
    """In each of so many parts of the log that shows walls enough most have to tell half of it: a round
    thing in a small room looks like a bent wall. More parts change fewer logs."""
    min_walls: int = 100
    """Least number of walls that decide. A larger value decides for fewer logs."""
    min_distance: float = 0.5
    """Nearest wall, m: what is nearer may be a part of the robot, or a small round thing. A smaller value
    counts more of these."""
    max_range: float = 8.0
    """Farthest beam on a wall, m: the farther, the less it is bent. A larger value fits more walls."""
    max_ratio: float = 2.5
    """Largest ratio of the ranges on a wall. A larger value fits more walls."""
    max_offset: float = 0.5
    """Largest length that is looked for, m."""
    same_offset: float = 0.5
    """Beams are fitted as a wall if the outer and the inner ones tell the same length to within this, m."""
    max_residual: float = 0.025
    """Largest standard deviation of the beams on a wall, m. A larger value takes more for walls."""
    least_noise: float = 0.005
    """Least standard deviation that beams are taken to have, m."""
    max_sigma: float = 0.06
    """Largest standard deviation of the length that a wall tells, m. A larger value counts more walls."""
    min_quartile: float = 0.03
    """Three quarters of them tell at least this length, m. A larger value changes fewer logs."""
    likely_quartile: float = 0.02
    """And from this one on that three quarters of them tell, m. A larger value names it for fewer logs."""
    bandwidth: float = 0.025
    """Width of the kernel with which the length that most walls tell is found, m."""
    mode_agreement: float = 0.04
    """Largest difference of that length from the one that half of the walls tell, m: else the walls are of
    several kinds. A larger value decides for more logs."""


class WallOffsets(NamedTuple):
    """What walls tell."""

    offsets: Array
    """(n,) lengths by which ranges are too long, m, in order."""
    weights: Array
    """(n,)"""
    distances: Array
    """(n,) of the walls from the laser, m."""

    @classmethod
    def of(cls, told: Array) -> WallOffsets:
        """From (n, 3) offsets, their standard deviations, and distances."""
        offsets, sigmas, distances = told[np.argsort(told[:, 0], kind="stable")].T
        return cls(offsets, sigmas**-2.0, distances)

    def quantile(self, share: float) -> float:
        """The length which walls of this share of the weight are below."""
        shares = np.cumsum(self.weights)
        return float(self.offsets[np.searchsorted(shares, share * shares[-1])])

    def tell(self, least: float, least_quartile: float) -> bool:
        """Whether half of the walls tell this length of one sign, m, and three quarters the second one."""
        middle = self.quantile(0.5)
        sign = math.copysign(1.0, middle)
        outer = self.quantile(0.25 if middle > 0.0 else 0.75)
        return sign * middle >= least and sign * outer >= least_quartile

    def is_of_ranges(self, clearly: float, options: BentWallOptions) -> bool:
        """Whether near walls tell as much as far ones do. A wrong angle between beams bends walls, too, as if
        ranges were too long by a share of themselves.

        `clearly` is how far what they tell is from that of a wrong angle: 0 there, 1 for a length.
        """
        is_near = self.distances < np.median(self.distances)
        near, far = (
            WallOffsets(self.offsets[some], self.weights[some], self.distances[some])
            for some in (is_near, ~is_near)
        )
        if not len(near.offsets):
            return False
        if abs(self.quantile(0.5)) > options.max_by_angle * float(np.median(self.distances)):
            return True
        nearness = float(np.median(near.distances) / np.median(far.distances))
        share = near.quantile(0.5) / far.quantile(0.5)
        return nearness < options.max_nearness and share > nearness + clearly * (1.0 - nearness)

    def most_told(self, options: BentWallOptions) -> float:
        """The length that most of the weight is about."""
        tried = np.arange(-options.max_offset, options.max_offset, options.bandwidth / 5.0)
        off = (self.offsets - tried[:, np.newaxis]) / options.bandwidth
        return float(tried[np.argmax(np.exp(-0.5 * off**2) @ self.weights)])


class BentWalls(NamedTuple):
    """What single walls tell of all ranges."""

    offset: float
    """By how much they are too long, m."""
    walls: int
    """The number of walls."""
    is_certain: bool
    """Whether it is beyond doubt."""


def by_bent_walls(
    ranges: NDArray[np.float32],
    steps: Array,
    is_all_around: bool,
    lengths: tuple[float, float],
    options: BentWallOptions = BentWallOptions(),
) -> BentWalls | None:
    """The length that single walls tell; None if they tell too little, or less than the first of two
    `lengths`, m; it is certain from the second one on.

    Only finite `ranges` (S, B) are distances, m; `steps` (S,) are the angles from beam to beam, rad. Beams
    that are a whole turn are as far apart as the log says.
    """
    likely, least_certain = lengths
    few, more = options.scans
    found = _wall_offsets(ranges, steps, few, options)
    if options.min_walls * few / more < len(found.offsets) < options.min_walls:
        found = _wall_offsets(ranges, steps, more, options)
    if len(found.offsets) < options.min_walls:
        return None
    if not found.tell(likely, options.likely_quartile):
        return None
    if not is_all_around and not found.is_of_ranges(0.0, options):
        return None
    offset, middle = found.most_told(options), found.quantile(0.5)
    if abs(offset - middle) > options.mode_agreement:
        return None
    sign = math.copysign(1.0, middle)
    least = min((sign * part.quantile(0.5) for part in _of_parts(ranges, steps, options)), default=np.inf)
    if least < 0.5 * likely:
        return None
    is_certain = found.tell(least_certain, options.min_quartile) and least >= 0.5 * least_certain
    is_certain &= is_all_around or found.is_of_ranges(0.5, options)
    return BentWalls(offset, len(found.offsets), is_certain)


def _of_parts(ranges: NDArray[np.float32], steps: Array, options: BentWallOptions) -> list[WallOffsets]:
    """What each part of the log tells that shows walls enough."""
    parts = np.array_split(np.arange(len(ranges)), options.parts)
    scans = options.scans[1] // options.parts
    told = [_wall_offsets(ranges[rows], steps[rows], scans, options) for rows in parts if len(rows)]
    return [part for part in told if len(part.offsets) * options.parts >= options.min_walls]


def _wall_offsets(
    ranges: NDArray[np.float32], steps: Array, scans: int, options: BentWallOptions
) -> WallOffsets:
    """What walls in so many scans tell."""
    some, step = ranges[evenly(len(ranges), scans)], abs(float(np.median(steps)))
    told = [np.zeros((0, 3))]
    for half_width in options.half_widths:
        half = round(half_width / step) if step > 0.0 else 0
        if half >= 3 and 2 * half < some.shape[1]:
            told.append(_told(some, step, half, options))
    return WallOffsets.of(np.concatenate(told))


def _told(ranges: NDArray[np.float32], step: float, half: int, options: BentWallOptions) -> Array:
    """(n, 3) offsets, deviations and distances, m, of walls within so many beams on both sides of one."""
    beside = np.unique(np.rint(np.linspace(-half, half, min(2 * half + 1, options.beams))).astype(np.int64))
    middles = np.arange(half, ranges.shape[1] - half, max(half // options.starts, 1))
    seen = ranges[:, middles[:, np.newaxis] + beside].reshape(-1, len(beside)).astype(np.float64)
    with np.errstate(invalid="ignore"):
        farthest = seen.max(axis=1)
        is_near = (farthest < options.max_range) & (farthest < options.max_ratio * seen.min(axis=1))
    seen = seen[is_near]
    angles: Array = step * beside.astype(np.float64)
    middle = len(beside) // 2
    outer, inner = (
        _of_three(seen[:, [middle - off, middle, middle + off]], angles[middle + off])
        for off in (middle, middle // 2)
    )
    with np.errstate(invalid="ignore"):
        seen = seen[(np.abs(outer - inner) < options.same_offset) & (np.abs(outer) < options.max_offset)]
    return _fitted(seen, angles, options)


def _of_three(ranges: Array, angle: float) -> Array:
    """(n,) the length that three beams (n, 3) on a wall tell, so many rad apart, to first order."""
    one, two, three = ranges.T
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = 1.0 / one + 1.0 / three - 2.0 * np.cos(angle) / two
        told: Array = -bend / (one**-2.0 + three**-2.0 - 2.0 * np.cos(angle) * two**-2.0)
    return told


def _fitted(seen: Array, angles: Array, options: BentWallOptions) -> Array:
    """(m, 3) offsets, deviations and distances of those ranges (n, B), at angles (B,), that lie on a wall.

    Gauss-Newton steps for r = 1/(a cos φ + b sin φ) + offset.
    """
    wave = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if not len(seen):
        return np.zeros((0, 3))
    line, offset = (1.0 / seen) @ np.linalg.pinv(wave).T, np.zeros(len(seen))
    for _ in range(6):
        inverse = np.maximum(line @ wave.T, 0.5 / options.max_range)
        slopes = np.concatenate([-wave / inverse[..., np.newaxis] ** 2, np.ones((*seen.shape, 1))], axis=2)
        residuals = seen - offset[:, np.newaxis] - 1.0 / inverse
        normal = np.swapaxes(slopes, 1, 2) @ slopes + 1e-9 * np.eye(3)
        change = np.linalg.solve(normal, np.swapaxes(slopes, 1, 2) @ residuals[..., np.newaxis])[..., 0]
        line = line + change[:, :2]
        offset = np.clip(offset + change[:, 2], -2.0 * options.max_offset, 2.0 * options.max_offset)
    residuals = seen - offset[:, np.newaxis] - 1.0 / np.maximum(line @ wave.T, 0.5 / options.max_range)
    noise = np.sqrt((residuals**2).sum(axis=1) / (len(angles) - 3))
    sigmas = np.maximum(noise, options.least_noise) * np.sqrt(np.linalg.inv(normal)[:, 2, 2])
    distances = 1.0 / np.hypot(*line.T)
    is_wall = (noise < options.max_residual) & (sigmas < options.max_sigma)
    is_wall &= distances > options.min_distance
    told: Array = np.column_stack([offset, sigmas, distances])[is_wall]
    return told
