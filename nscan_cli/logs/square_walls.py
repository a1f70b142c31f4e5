"""The angle between beams, by walls that stand square to each other or parallel, as in most buildings.

If beams are seen by a share f farther apart than they are, a wall at bearing φ, at the angle ψ to the beam
that meets it, is seen turned by f (φ + ½ sin 2ψ). If ranges are too long by a length d, it is seen turned by
d/r ½ sin 2ψ. So two walls at different bearings are not square any more, and both f and d are told by pairs
of walls, though a wrong angle bends single walls as a wrong length does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.robot_parts import evenly
from nscan_cli.logs.wall_angles import SampledScans
from nscan_cli.poses import Array


@dataclass(frozen=True)
class SquareWallOptions:
    """When pairs of walls tell the angle between beams."""

    scans: tuple[int, ...] = (80, 320)
    """Numbers of scans that are looked at, evenly spread: more of them where fewer show few pairs, or do not
    agree with the log. More take longer."""
    widths: tuple[float, ...] = (0.2, 0.4)
    """Beams over these angles are fitted as walls, rad. Wider ones tell their direction more precisely, and
    there are fewer."""
    least_beams: int = 7
    """Least number of beams on a wall. A larger value takes fewer for walls."""
    ranges: tuple[float, float] = (0.3, 12.0)
    """Nearest and farthest reading on a wall, m. Wider limits take more for walls."""
    max_residual: float = 0.02
    """Largest standard deviation of readings from a wall, m. A larger value takes more for walls."""
    least_noise: float = 0.005
    """Least standard deviation that readings are taken to have, m."""
    max_sigma: float = math.radians(0.8)
    """Largest standard deviation of the direction of a wall, rad. A larger value counts more walls."""
    min_length: float = 0.5
    """Least length of a wall, m. A larger value counts fewer walls."""
    min_between: float = math.radians(50.0)
    """Least angle between the bearings of two walls that are compared, rad. With a larger value fewer pairs
    tell more each."""
    max_pairs: int = 3000
    """Number of pairs that are looked at, evenly spread. More take longer, and tell more precisely."""
    scatter: float = math.radians(0.6)
    """Standard deviation of the angle between walls that count as square, rad. A larger value takes more for
    square, and is less precise."""
    max_share: float = 0.08
    """Largest share by which the angle between beams is looked for. A larger value takes longer."""
    max_length: float = 0.16
    """Largest length by which ranges are taken to be too long or short, m. A larger value takes longer."""
    steps: tuple[int, int] = (27, 9)
    """Numbers of shares and of lengths that are tried first. More take longer."""
    first_pairs: int = 800
    """With so many of the pairs, evenly spread. More take longer, and find the best more surely."""
    rounds: int = 8
    """Number of fits from the best of these on. More are more precise."""
    enough_pairs: int = 1500
    """With fewer pairs than this more scans are looked at. A larger value takes longer."""
    sound_share: float = 0.004
    """The angle of the log is right without looking at more scans if the share is smaller. A larger value
    takes less time."""
    min_pairs: int = 400
    """Least number of pairs that decide. A larger value decides for fewer logs."""
    parts: int = 4
    """All but one of so many parts of the log must tell about the same. More parts decide for fewer logs."""
    part_agreement: float = 2.0
    """A part tells the same if its share is within this factor of that of the log. A larger value decides for
    more logs."""
    min_share: float = 0.008
    """Least share by which beams are closer or wider than the log says, where they cover a usual field of
    view then: it is -0.002 to 0.003 on real logs. A larger value contradicts fewer logs."""
    min_gain: float = 1.07
    """The walls are square in more pairs with it than with the angle of the log, by this factor at least. A
    larger value contradicts fewer logs."""
    min_gain_by_share: float = 3.5
    """And by 1 plus so many times the share: a wrong angle leaves the fewer pairs square the larger it is. A
    larger value contradicts fewer logs."""
    clear_share: float = 0.015
    """Least share where they do not cover a usual one. A larger value contradicts fewer logs."""
    clear_gain: float = 1.5
    """The factor there. A larger value contradicts fewer logs."""
    max_view: float = math.radians(340.0)
    """Largest field of view that is checked, rad: whole_revolution.py knows more of lasers that see all
    around. With a larger value more lasers are."""


class WallPairs(NamedTuple):
    """P pairs of walls."""

    excess: Array
    """(P,) angle between the two, less the nearest multiple of a right angle, rad"""
    by_share: Array
    """(P,) what a share of 1 adds to that, rad"""
    by_length: Array
    """(P,) what a length of 1 m adds to it, rad/m"""
    variance: Array
    """(P,) rad²"""

    def some(self, rows: NDArray[np.int64]) -> WallPairs:
        """Those pairs alone."""
        return WallPairs(*(values[rows] for values in self))


class SeenSquare(NamedTuple):
    """With what most pairs of walls are square."""

    share: float
    """By how much the beams are closer than the log says, as a share."""
    length: float
    """By how much ranges are too long, m."""
    gain: float
    """How many more pairs are square with the share than without, as a factor."""

    @property
    def factor(self) -> float:
        """The angle between beams as a multiple of that of the log."""
        return 1.0 / (1.0 + self.share)

    def is_clear(self, options: SquareWallOptions) -> bool:
        """Whether it stands without a usual field of view."""
        return abs(self.share) >= options.clear_share and self.gain >= options.clear_gain


def told_by_square_walls(
    sample: Callable[[int], SampledScans], options: SquareWallOptions = SquareWallOptions()
) -> SeenSquare | None:
    """With what most pairs of walls of a log are square; None if that is its angle between beams, or they
    tell too little. `sample` gives so many of its scans."""
    for count in options.scans:
        pairs = wall_pairs(sample(count), options)
        if len(pairs.excess) < options.min_pairs:
            continue
        found = seen_square(pairs, options)
        if abs(found.share) < options.sound_share:
            return None
        if len(pairs.excess) >= options.enough_pairs:
            break
    if len(pairs.excess) < options.min_pairs:
        return None
    size = abs(found.share)
    if not options.min_share <= size <= options.max_share:
        return None
    if found.gain < max(options.min_gain, 1.0 + options.min_gain_by_share * size):
        return None
    agreeing = 0
    for rows in np.array_split(np.arange(len(pairs.excess)), options.parts):
        part = seen_square(pairs.some(rows), options).share / found.share
        agreeing += 1.0 / options.part_agreement < part < options.part_agreement
    return found if agreeing >= options.parts - 1 else None


def wall_pairs(scans: SampledScans, options: SquareWallOptions) -> WallPairs:
    """The pairs of walls of the scans, in their order."""
    walls = [_walls(scans, width, options) for width in options.widths]
    is_wall = np.concatenate([each.is_wall for each in walls], axis=1)
    direction, bearing, variance, by_share, by_length = (
        np.concatenate([each[column] for each in walls], axis=1) for column in range(1, 6)
    )
    one, two = np.nonzero(bearing[:1] - bearing[:1].T > options.min_between)
    rows, columns = np.nonzero(is_wall[:, one] & is_wall[:, two])
    if not len(rows):
        return WallPairs(*(np.zeros(0),) * 4)
    kept = evenly(len(rows), options.max_pairs)
    rows, columns = rows[kept], columns[kept]
    one, two = one[columns], two[columns]

    def between(values: Array) -> Array:
        difference: Array = values[rows, two] - values[rows, one]
        return difference

    excess = np.mod(between(direction) + 0.25 * np.pi, 0.5 * np.pi) - 0.25 * np.pi
    both = variance[rows, one] + variance[rows, two] + options.scatter**2
    return WallPairs(excess, between(by_share), between(by_length), both)


class _Walls(NamedTuple):
    """Walls about W beams of N scans."""

    is_wall: NDArray[np.bool_]
    """(N, W)"""
    direction: Array
    """(N, W) rad"""
    bearing: Array
    """(N, W) rad"""
    variance: Array
    """(N, W) of the direction, rad²"""
    by_share: Array
    """(N, W) by how much beams that are farther apart by a share of 1 turn it, rad"""
    by_length: Array
    """(N, W) by how much ranges that are too long by 1 m turn it, rad"""


def _walls(scans: SampledScans, width: float, options: SquareWallOptions) -> _Walls:
    """Lines through the beams over a width (rad), each half a width from the next, by total least squares."""
    ranges, size = scans.ranges, scans.ranges.shape[1]
    step = float(np.median(scans.steps)) if len(ranges) else 0.0
    # A damaged log may have hardly any angle between beams, or one that is no number.
    half = round(min(0.5 * width / step, size)) if 0.0 < step < np.inf else size
    half = max(half, (options.least_beams - 1) // 2)
    middles = np.arange(half, size - half, half)
    bearings = scans.steps[:, np.newaxis] * np.arange(size)
    with np.errstate(invalid="ignore"):
        is_seen = (ranges > options.ranges[0]) & (ranges < options.ranges[1])
    seen = np.where(is_seen, ranges, 0.0)
    x, y = seen * np.cos(bearings), seen * np.sin(bearings)
    count = 2 * half + 1

    def mean(values: Array) -> Array:
        """(N, W) over the beams about each middle one."""
        sums = np.pad(np.cumsum(values, axis=1), ((0, 0), (1, 0)))
        found: Array = (sums[:, middles + half + 1] - sums[:, middles - half]) / count
        return found

    centre_x, centre_y = mean(x), mean(y)
    xx, xy, yy = mean(x * x) - centre_x**2, mean(x * y) - centre_x * centre_y, mean(y * y) - centre_y**2
    direction = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    middle, apart = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    across, along = np.maximum(middle - apart, 0.0), middle + apart
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.maximum(across, options.least_noise**2) / (along * count)
        is_wall = (mean(is_seen.astype(np.float64)) > 1.0 - 0.5 / count) & (variance < options.max_sigma**2)
        # Evenly spread points of a line of length l have the variance l²/12.
        is_wall &= (across < options.max_residual**2) & (12.0 * along > options.min_length**2)
    leaning = 0.5 * np.sin(2.0 * (direction - np.arctan2(centre_y, centre_x)))
    bearing = bearings[:, middles]
    by_length = leaning / np.maximum(np.hypot(centre_x, centre_y), options.ranges[0])
    return _Walls(is_wall, direction, bearing, variance, bearing + leaning, by_length)


def seen_square(pairs: WallPairs, options: SquareWallOptions) -> SeenSquare:
    """The share and the length with which most pairs are square."""
    if not len(pairs.excess):
        return SeenSquare(0.0, 0.0, 1.0)
    shares = np.linspace(-options.max_share, options.max_share, options.steps[0])
    lengths = np.linspace(-options.max_length, options.max_length, options.steps[1])
    some = pairs.some(evenly(len(pairs.excess), options.first_pairs))
    precise, counts = -0.5 / some.variance, np.empty((len(shares), len(lengths)))
    for column, length in enumerate(lengths):
        left = some.excess - length * some.by_length
        off = left - shares[:, np.newaxis] * some.by_share
        counts[:, column] = np.exp(precise * off * off).sum(axis=1)
    row, best = divmod(int(counts.argmax()), len(lengths))
    share, length = settled(pairs, float(shares[row]), float(lengths[best]), options)
    start = float(lengths[counts[len(shares) // 2].argmax()])
    _none, other = settled(pairs, 0.0, start, options, are_free=(False, True))
    gain = count_square(pairs, share, length) / max(count_square(pairs, 0.0, other), 1e-9)
    return SeenSquare(share, length, gain)


def count_square(pairs: WallPairs, share: float, length: float) -> float:
    """How many pairs are square."""
    off = pairs.excess - share * pairs.by_share - length * pairs.by_length
    return float(np.exp(-0.5 * off * off / pairs.variance).sum())


def normal_equations(
    pairs: WallPairs, share: float, length: float, are_free: tuple[bool, bool] = (True, True)
) -> tuple[Array, Array]:
    """The matrix (2, 2) and the right side (2,) of a round of weighted least squares for the changes of share
    and length (m); what is not free stays as it is."""
    columns = np.column_stack([pairs.by_share, pairs.by_length]) * are_free
    off = pairs.excess - share * pairs.by_share - length * pairs.by_length
    weights = np.exp(-0.5 * off * off / pairs.variance) / pairs.variance
    matrix: Array = columns.T @ (weights[:, np.newaxis] * columns) + 1e-9 * np.eye(2)
    return matrix, columns.T @ (weights * off)


def settled(
    pairs: WallPairs,
    share: float,
    length: float,
    options: SquareWallOptions,
    are_free: tuple[bool, bool] = (True, True),
) -> tuple[float, float]:
    """The share and the length (m) at which so many rounds arrive."""
    for _ in range(options.rounds):
        change = np.linalg.solve(*normal_equations(pairs, share, length, are_free))
        share, length = share + float(change[0]), length + float(change[1])
    return share, length
