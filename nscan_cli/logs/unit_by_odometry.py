"""The unit of the readings by odometry: a scan predicts the next one, if both are in one unit.

A reading of 90 may be of a hall in metres or of a room in inches. Where odometry says how far the robot went,
the scan before predicts the ranges of the next one, in the unit that the readings have; in another one the
step is too long or too short.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import counted
from nscan_cli.logs.expected_sizes import ExpectedSizes, ranges_over_odometry
from nscan_cli.logs.predicted_ranges import beams_along, predicted_ranges
from nscan_cli.logs.range_unit import RangeUnitOptions, end_of_distances
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.robot_parts import evenly
from nscan_cli.logs.scan_order import ScanOrder
from nscan_cli.poses import Array, Indices, are_known, compose, relative, wrap

SMALLER_UNITS = (
    ("millimetres", 0.001),
    ("centimetres", 0.01),
    ("inches", 0.0254),
    ("decimetres", 0.1),
    ("feet", 0.3048),
    ("millimetres taken for inches", 0.001 / 0.0254),
    ("centimetres taken for feet", 0.01 / 0.3048),
    ("millimetres taken for feet", 0.001 / 0.3048),
)
"""Units that readings may have instead of metres, in metres, also if a driver takes them for another unit
than its laser has."""
LARGER_UNITS = (
    ("metres divided by 10", 10.0),
    ("inches taken for millimetres", 0.0254 / 0.001),
    ("feet taken for centimetres", 0.3048 / 0.01),
)
"""The same if the readings are too small then. Where they were divided by 100 their size tells it."""


@dataclass(frozen=True)
class UnitByOdometryOptions:
    """When odometry tells the unit of the readings."""

    min_median: float = 5.0
    """Only readings with a larger median may be in a unit smaller than a metre, m. A smaller value looks at
    more logs."""
    max_median: float = 0.6
    """Only readings with a smaller median may have been divided, m. A larger value looks at more logs."""
    max_same_share: float = 0.02
    """A value that more than this share of the readings have is a code and no distance. A larger value
    compares more readings."""
    base_scans: int = 1000
    """Number of scans, evenly spread, that are taken as the earlier of two. More take longer."""
    spans: tuple[int, ...] = (1, 2, 4, 8, 16)
    """The later of two scans is so many behind."""
    move: float = 0.15
    """Two scans are compared if the step between them is this share of the median reading, by a factor of
    `move_within`: shorter ones tell little, and longer ones show other things."""
    move_within: float = 1.6
    """See `move`. A larger value compares more scans."""
    max_turn: float = 0.1
    """Largest turn between two scans that are compared, rad. A larger value compares more."""
    pairs: int = 64
    """Number of pairs of scans for each unit. More take longer."""
    min_pairs: int = 16
    """Least number of pairs that decide. A larger value decides for fewer logs."""
    beams: int = 180
    """Approximate number of beams that are compared. More take longer."""
    min_beams: int = 20
    """Least number of ranges of a scan that the one before predicts. A larger value compares fewer scans."""
    tolerance: float = 0.05
    """A range is as predicted to within this share. A larger value counts more."""
    min_gain: float = 0.02
    """A step explains a pair if so much more of its beams are as predicted than without the step, and
    contradicts it if so much fewer. A larger value counts fewer pairs."""
    min_share: float = 0.7
    """Share of the pairs that the right unit explains, at least; it is 0.8 to 1.0 on real logs, and 0.0 to
    0.1 in another unit. A larger value decides for fewer logs."""
    max_opposed: float = 0.2
    """Share of the pairs that the right unit contradicts, at most. A smaller value decides for fewer logs."""
    expected: ExpectedSizes = field(default_factory=ExpectedSizes)
    """What tells whether the ranges or odometry are in another unit."""
    beside: float = 1.25
    """The right unit explains pairs better than one that is larger or smaller by this factor: odometry may be
    wrong by a factor that is near to that of a unit. A smaller value decides for fewer logs."""
    min_factor: float = 3.0
    """Ranges are in another unit, rather than odometry, if both together are nearer to what is expected then
    by this factor. A larger value decides for fewer logs."""


class _Explained(NamedTuple):
    """How well steps explain pairs of scans."""

    share: float
    """Share of the pairs that they explain."""
    gain: float
    """Mean share of the beams that they explain and that are not as predicted without them."""
    pairs: int


class UnitByOdometry(NamedTuple):
    """The unit of the readings with which odometry agrees."""

    name: str
    scale: float
    """m"""
    evidence: _Explained
    """How well odometry, in that unit, explains pairs of scans."""

    @property
    def correction(self) -> str:
        """The message if the unit is put right."""
        other = ""
        if self.name == "feet":
            # Odometry that someone converted twice is off by such a factor, too.
            other = "; if odometry is too short instead, and so the map, --range-scale 1"
        return (
            f"the ranges are in {self.name}: then odometry explains how they change, in "
            f"{self.evidence.share:.0%} of {counted(self.evidence.pairs, 'pair')} of scans: they are "
            f"multiplied by {self.scale:g}; --as-recorded leaves them as they are, --range-scale sets "
            f"another factor{other}"
        )


def unit_by_odometry(
    raw: RawScans,
    order: ScanOrder,
    odometry: Array | None,
    mount: Array,
    no_return: float | None,
    options: UnitByOdometryOptions = UnitByOdometryOptions(),
) -> UnitByOdometry | None:
    """The unit of the readings, if odometry (S, 3), in order of time, tells that they are not in metres.

    None for metres, and if nothing tells it. `no_return` is the reading that seems to mean "no return".
    """
    if odometry is None or len(odometry) < 2:
        return None
    beams = slice(None, None, max(raw.ranges.shape[1] // options.beams, 1))
    some = raw.ranges[order.rows[evenly(len(order.rows), options.pairs)], beams]
    some = some[(some > 0.0) & np.isfinite(some)]
    end = end_of_distances(some, no_return)
    values, counts = np.unique(some, return_counts=True)
    codes = values[counts > options.max_same_share * some.size]
    returns = some[(some < end) & ~np.isin(some, codes)]
    median = float(np.median(returns)) if returns.size else 0.0
    if not 0.0 < median <= options.max_median and median < options.min_median:
        return None
    units: Sequence[tuple[str, float]] = SMALLER_UNITS if median >= options.min_median else LARGER_UNITS
    steps = _Steps.of(odometry, mount, options)
    speed = steps.usual_speed(order.times)
    if speed == 0.0:
        return None
    scans = _Readings(raw, order, end, codes, beams)
    if _explained(scans, steps, median, options) is not None:
        return None
    told, sizes = [], RangeUnitOptions()
    for name, scale in units:
        if not sizes.min_median <= median * scale <= sizes.max_median:
            # Of ranges in such a unit, odometry is in another one as well.
            continue
        # Or odometry is in another unit, and the ranges are in metres.
        if ranges_over_odometry(median, speed, scale, options.expected) > options.min_factor:
            found = _explained(scans, steps.scaled(1.0 / scale), median, options)
            if found is not None:
                told.append(UnitByOdometry(name, scale, found))
    return max(told, key=lambda unit: unit.evidence.gain, default=None)


class _Steps(NamedTuple):
    """Steps of the laser by odometry between two scans each, with little turn."""

    first: Indices
    """(n,) positions of the earlier scans in order of time."""
    last: Indices
    """(n,) those of the later ones."""
    steps: Array
    """(n, 3)"""

    @classmethod
    def of(cls, odometry: Array, mount: Array, options: UnitByOdometryOptions) -> _Steps:
        """The steps between some scans and those that are some scans behind."""
        size, pairs = len(odometry), []
        for span in options.spans:
            if size > span:
                first = evenly(size - span, options.base_scans)
                pairs.append((first, first + span))
        first, last = (np.concatenate(rows) for rows in zip(*pairs, strict=True))
        known = are_known(odometry)
        is_known = known[first] & known[last]
        first, last = first[is_known], last[is_known]
        steps = relative(compose(relative(odometry[last], odometry[first]), mount), mount)
        is_straight = np.abs(wrap(steps[:, 2])) < options.max_turn
        return cls(first[is_straight], last[is_straight], steps[is_straight])

    @property
    def lengths(self) -> Array:
        """(n,) lengths, m."""
        return np.hypot(self.steps[:, 0], self.steps[:, 1])

    def scaled(self, factor: float) -> _Steps:
        """The steps in another unit."""
        return self._replace(steps=self.steps * (factor, factor, 1.0))

    def usual_speed(self, times: Array) -> float:
        """The usual speed of the robot where it moves, m/s; 0 if it does not. Scans are at times (S,), s."""
        lasted = times[self.last] - times[self.first]
        moves = (lasted > 0.0) & (self.lengths > 0.0)
        return float(np.median(self.lengths[moves] / lasted[moves])) if moves.any() else 0.0


class _Readings(NamedTuple):
    """The readings of some beams, in order of time."""

    raw: RawScans
    order: ScanOrder
    end: float
    """Readings from here on are of no distance."""
    codes: NDArray[np.float32]
    """(k,) readings that are of no distance."""
    beams: slice

    def of(self, rows: Indices, beams: slice) -> Array:
        """(n, B) readings of scans at positions (n,); nan for none."""
        found = self.raw.ranges[self.order.rows[rows], beams]
        is_distance = (found > 0.0) & (found < self.end)
        for code in self.codes:
            is_distance &= found != code
        return np.where(is_distance, found.astype(np.float64), np.nan)

    def directions(self, rows: Indices) -> tuple[Array, Array]:
        """(n, 1) the first directions and the angles from beam to beam, rad."""
        at = self.order.rows[rows], np.newaxis
        return self.raw.angle_min[at], self.raw.angle_increment[at]


def _explained(
    scans: _Readings, steps: _Steps, median: float, options: UnitByOdometryOptions
) -> _Explained | None:
    """How well steps explain scans with a median reading; None if they do not explain most pairs."""
    shares = steps.lengths / (options.move * median)
    near = np.flatnonzero((shares > 1.0 / options.move_within) & (shares < options.move_within))
    if len(near) < options.min_pairs:
        return None
    near = near[evenly(len(near), options.pairs)]
    pairs, moved = _Pairs.of(scans, steps.first[near], steps.last[near]), steps.steps[near]
    lengths = 0.0, 1.0, options.beside, 1.0 / options.beside
    without, right, longer, shorter = (
        pairs.as_predicted(moved * (length, length, 1.0), options) for length in lengths
    )
    gains = right - without
    is_told = np.isfinite(gains)
    if np.count_nonzero(is_told) < options.min_pairs:
        return None
    gains, others = gains[is_told], [float(np.nanmean(each[is_told])) for each in (longer, shorter)]
    share, opposed = (float((sign * gains > options.min_gain).mean()) for sign in (1.0, -1.0))
    if share < options.min_share or opposed > options.max_opposed or max(others) > right[is_told].mean():
        return None
    return _Explained(share, float(gains.mean()), len(gains))


class _Pairs(NamedTuple):
    """The readings of n pairs of scans."""

    lengths: Array
    """(n, b) of some beams of the earlier scans."""
    angles: Array
    """(n, b) directions of these, rad."""
    later: Array
    """(n, B) all readings of the later scans."""
    first: Array
    """(n, 1) the first directions of these, rad."""
    between: Array
    """(n, 1) the angles from beam to beam, rad."""

    @classmethod
    def of(cls, scans: _Readings, first: Indices, last: Indices) -> _Pairs:
        """The pairs of scans at positions (n,)."""
        begin, between = scans.directions(first)
        later = scans.of(last, slice(None))
        angles = begin + between * np.arange(later.shape[1])[scans.beams]
        return cls(scans.of(first, scans.beams), angles, later, *scans.directions(last))

    def as_predicted(self, steps: Array, options: UnitByOdometryOptions) -> Array:
        """(n,) share of the readings that are as the scan before predicts with steps (n, 3); nan for few."""
        predicted, directions = predicted_ranges(self.lengths, self.angles, steps)
        beams, has = beams_along(directions, self.first, self.between, self.later.shape[1])
        seen = np.take_along_axis(self.later, beams, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.where(has, np.abs(np.log(seen / predicted)), np.nan)
        count = np.count_nonzero(np.isfinite(off), axis=1)
        near = np.count_nonzero(off < options.tolerance, axis=1)
        share: Array = np.where(count >= options.min_beams, near / np.maximum(count, 1), np.nan)
        return share
