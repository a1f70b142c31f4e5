"""A scan from which on the readings come in the other order, or the laser looks elsewhere."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.odometry_options import ViewChangeOptions
from nscan_cli.calibration.robust_fit import median
from nscan_cli.calibration.scale_change import sigma_of_change
from nscan_cli.poses import Array, Indices, Mask, compose, relative, wrap


class TurnChange(NamedTuple):
    """Turns by odometry as a multiple of those by scans, in the steps before and behind a place."""

    step: int
    """The first step behind it."""
    before: float
    behind: float
    steps: int
    """Number of steps with a turn."""

    @property
    def is_order(self) -> bool:
        """Whether the turns are opposite on one side of it alone."""
        return self.before * self.behind < 0.0


class DirectionChange(NamedTuple):
    """Where the laser looks on the robot in the steps before and behind a place, rad."""

    step: int
    """The first step behind it."""
    before: float
    behind: float
    sigma: float
    """Standard deviation of their difference."""
    steps: int
    """Number of steps with motion."""
    end: int | None = None
    """The first step from which on it looks as before again; None if it does not."""

    def exceeds(self, turn: float, sigmas: float) -> bool:
        """Whether the two differ by more than a turn, rad, and by more than so many standard deviations."""
        return abs(float(wrap(self.behind - self.before))) > max(turn, sigmas * self.sigma)

    def may_be_mirrored(self, tolerance: float) -> bool:
        """Whether the directions are mirror images of each other, to within a tolerance (rad)."""
        apart, sum_of_both = (abs(float(wrap(self.behind + sign * self.before))) for sign in (-1.0, 1.0))
        return apart > tolerance and sum_of_both < tolerance


def turn_change(laser: Array, odometry: Array, least: int, options: ViewChangeOptions) -> TurnChange | None:
    """The clearest change of the signs of turns along steps (n, 3) of laser and robot, in order.

    None for fewer turns than `least` on both sides, and where the turns of one side are of both signs.
    """
    told: Indices = np.flatnonzero(np.abs(laser[:, 2]) >= options.min_turn)
    ratios = odometry[told, 2] / laser[told, 2]
    signs = np.sign(ratios)
    place = _clearest_split(signs[:, None], least)
    if place is None:
        return None
    sides = [signs[:place], signs[place:]]
    if min(abs(float(side.mean())) for side in sides) < options.min_agreement:
        return None
    before, behind = (median(some) for some in (ratios[:place], ratios[place:]))
    return TurnChange(int(told[place]), before, behind, len(told))


def direction_change(
    laser: Array, odometry: Array, mount: Array, least: int, options: ViewChangeOptions
) -> DirectionChange | None:
    """The clearest change of the direction of the laser along steps (n, 3) of it and the robot, in order.

    `mount` (3,) is the mounting in the file, whose place is believed. None for fewer steps than `least` on
    both sides.
    """
    # Odometry may be in another unit than the place of the laser.
    lengths = [np.hypot(steps[:, 0], steps[:, 1]) for steps in (laser, odometry)]
    moves: Mask = (lengths[0] >= options.min_length) & (lengths[1] > 0.0)
    # Where odometry is late, it leads elsewhere in a turn.
    moves &= np.abs(laser[:, 2]) <= options.max_step_turn
    if not moves.any():
        return None
    scale = median(lengths[0][moves] / lengths[1][moves])
    place = np.array([*mount[:2], 0.0])
    by_odometry = relative(compose(odometry * (scale, scale, 1.0), place), place)
    told: Indices = np.flatnonzero(moves & (np.hypot(*by_odometry[:, :2].T) >= options.min_length))
    driven, seen = (np.arctan2(steps[told, 1], steps[told, 0]) for steps in (by_odometry, laser))
    angles = driven - seen
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    split = _clearest_split(directions, least)
    if split is None:
        return None
    stretch = _clearest_stretch(directions, split, least, options)
    split, end = (split, len(angles)) if stretch is None else stretch
    is_behind = np.zeros(len(angles), dtype=np.bool_)
    is_behind[split:end] = True
    before, behind = (_usual_direction(some) for some in (angles[~is_behind], angles[is_behind]))
    sides = wrap(angles[~is_behind] - before), wrap(angles[is_behind] - behind)
    drift = options.part_weight * _sigma_of_parts(*sides, options.min_steps)
    sigma = max(sigma_of_change(*sides), min(drift, options.max_part_sigma))
    back = None if stretch is None else int(told[end])
    return DirectionChange(int(told[split]), before, behind, sigma, len(told), back)


def _clearest_split(values: Array, least: int) -> int | None:
    """The place at which two means explain values (n, d) best, with so many on both sides; None if few."""
    places = np.arange(least, len(values) - least + 1)
    if not len(places):
        return None
    sums = np.cumsum(values, axis=0)
    before, behind = sums[places - 1], sums[-1] - sums[places - 1]
    gains = (before**2).sum(axis=1) / places + (behind**2).sum(axis=1) / (len(values) - places)
    return int(places[np.argmax(gains)])


def _clearest_stretch(
    values: Array, split: int, least: int, options: ViewChangeOptions
) -> tuple[int, int] | None:
    """The places between which directions (n, 2) differ from those before and behind, with so many in each
    part; None if they are better explained by two parts with a place `split` between."""
    sums = np.concatenate([np.zeros((1, 2)), np.cumsum(values, axis=0)])
    left = _left(sums[split], split) + _left(sums[-1] - sums[split], len(values) - split)
    places = np.arange(least, len(values) - least + 1)
    if left < options.min_left * len(values) or len(places) < 2:
        return None
    inside = sums[places] - sums[places, None]
    counts = (places - places[:, None]).astype(np.float64)
    counts[counts < least] = np.nan
    lefts = _left(inside, counts) + _left(sums[-1] - inside, len(values) - counts)
    if np.isnan(lefts).all():
        return None
    first, last = np.unravel_index(np.nanargmin(lefts), lefts.shape)
    is_clear = lefts[first, last] < options.max_left_of_stretch * left
    return (int(places[first]), int(places[last])) if is_clear else None


def _left(sums: Array, counts: Array | int) -> Array:
    """(…) what the mean of so many directions leaves unexplained of them; their sums are (…, 2)."""
    found: Array = counts - (sums**2).sum(axis=-1) / counts
    return found


def _sigma_of_parts(before: Array, behind: Array, length: int) -> float:
    """Standard deviation (rad) of a change, from how much parts of so many steps differ on either side of it.

    `before` (n,) and `behind` (m,) are the residuals on both sides, in order. Where headings by odometry
    drift, steps beside each other are off by the same.
    """
    parts = [
        side[: len(side) // length * length].reshape(-1, length).mean(axis=1) for side in (before, behind)
    ]
    freedom = sum(map(len, parts)) - 2
    if freedom < 1:
        return 0.0
    squares = sum(float(((side - side.mean()) ** 2).sum()) for side in parts if len(side))
    counts = [len(side) / length for side in (before, behind)]
    return float(np.sqrt(squares / freedom * (1.0 / counts[0] + 1.0 / counts[1])))


def _usual_direction(angles: Array) -> float:
    """The median of directions (n,), rad."""
    usual = float(np.arctan2(median(np.sin(angles)), median(np.cos(angles))))
    return float(wrap(usual + median(wrap(angles - usual))))
