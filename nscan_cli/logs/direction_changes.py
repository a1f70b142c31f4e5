"""Directions of beams that change in the file from a scan on, though the laser looks as before.

From one scan to the next a robot moves little, and most beams have nearly the same range again. If the laser
looked elsewhere, those in the same direction would have it, and not those of the same number.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.beam_angles import BeamDirections
from nscan_cli.logs.mask_runs import stretch_names
from nscan_cli.logs.robot_parts import ScanTable, ranges_at
from nscan_cli.poses import Indices


@dataclass(frozen=True)
class DirectionChangeOptions:
    """When directions change in the file alone."""

    min_change: float = math.radians(1.0)
    """Least change of the first or last direction, rad. A smaller value checks more scans."""
    max_changes: int = 8
    """Files in which directions change more often are left as they are. A larger value checks more of
    them."""
    max_turn: float = math.radians(15.0)
    """Largest turn of the robot between two scans that is tried, rad; it is less where directions change
    little. A larger value takes longer."""
    max_turn_share: float = 0.4
    """Where directions change little, the robot is tried to turn by no more than this share of the change. A
    larger value takes longer, and may take a turn of the robot for the change."""
    turn_step: float = math.radians(1.0)
    """Interval between the turns that are tried, rad. A smaller value takes longer."""
    same_range: float = 0.1
    """Readings are nearly the same if they differ by no more than this share. A larger value takes more other
    places for the same."""
    min_beams: int = 20
    """Least number of beams that are compared. A larger value finds less."""
    min_gain: float = 0.2
    """Of two successive scans the share of beams is counted that see nearly the same as the beam of the same
    number, and as the beam in the same direction. Directions stay if the first share is larger by this, and
    change if the second one is. Between both the user gets a message alone. A larger value corrects less, and
    gives more messages."""


def corrected_directions(table: ScanTable, counts: Indices, sign: int) -> tuple[BeamDirections, list[str]]:
    """The directions of the scans of a log, in file order, put right where scans show no change.

    Of several directions that are the same, those of most scans are used. Also returns messages. `counts`
    (S,) are the numbers of beams, in file order; `sign` is −1 if options count angles the other way round.
    """
    options = DirectionChangeOptions()
    found = BeamDirections(table.angle_min.copy(), table.angle_increment.copy())
    first, step, beams = found.first[table.rows], found.step[table.rows], counts[table.rows]
    ends = np.stack([first, first + step * (beams - 1)])
    is_changed = (np.abs(np.diff(ends)) >= options.min_change).any(axis=0)
    is_changed &= (np.diff(beams) == 0) & (step[1:] * step[:-1] > 0.0)
    places = (np.flatnonzero(is_changed) + 1).tolist()
    if not places or len(places) > options.max_changes:
        return found, []
    # Parts of one group look in the same directions.
    parts = list(itertools.pairwise([0, *places, len(first)]))
    groups, doubts = [[parts[0]]], list[int]()
    for part in parts[1:]:
        gain = _gain_of_numbers(table, part[0])
        if gain >= options.min_gain:
            groups[-1].append(part)
        else:
            groups.append([part])
            doubts += [part[0]] if gain > -options.min_gain else []
    written = {part: (float(first[part[0]]), float(step[part[0]])) for part in parts}
    lengths = Counter[tuple[float, float]]()
    for (begin, end), directions in written.items():
        lengths[directions] += end - begin
    said = list[str]()
    for group in groups:
        used = max((written[part] for part in group), key=lambda each: lengths[each])
        wrong = [part for part in group if written[part] != used]
        for begin, end in wrong:
            some = table.rows[begin:end]
            found.first[some], found.step[some] = used
        if wrong:
            told = _named(*written[wrong[0]])
            names = stretch_names((begin, end - 1) for begin, end in wrong)
            said.append(
                f"the beams of scans {names} begin at {told} by the file, but see what those of the others "
                f"see, which begin at {_named(*used)}: these directions are used; --as-recorded believes the "
                "file"
            )
    first, step = found.first[table.rows], found.step[table.rows]
    for place in doubts:
        before, behind = ((float(first[row]), float(step[row])) for row in (place - 1, place))
        if before != behind:
            angles = [f"{sign * math.degrees(value):.6g}" for value in before]
            said.append(
                f"from scan {place} on the beams begin at {_named(*behind)} by the file, before at "
                f"{_named(*before)}; if the laser did not change, try --angle-min {angles[0]} "
                f"--angle-increment {angles[1]}"
            )
    return found, said


def _named(first: float, step: float) -> str:
    return f"{math.degrees(first):.4g}° in steps of {math.degrees(step):.4g}°"


def _gain_of_numbers(table: ScanTable, place: int) -> float:
    """Whether scans go on by number or by direction from a place on: the difference of two shares of beams.

    The first share is of beams that see what the beam of the same number saw in the scan before. The second
    is of those that see what the beam in the same direction saw. Of the differences in three pairs of scans
    the smallest is returned if it is above 0, else the largest.
    """
    options = DirectionChangeOptions()
    last, gains = len(table.rows) - 1, []
    for one, other in ((place - 1, place), (max(place - 2, 0), place), (place - 1, min(place + 1, last))):
        by_number, by_file = table.bearings(table.rows[one]), table.bearings(table.rows[other])
        seen = ranges_at(table, np.array([other]), by_file)[0]
        # The robot may turn meanwhile, by less than what is to be told.
        change = float(np.abs(by_file - by_number)[[0, -1]].max())
        most = min(options.max_turn, options.max_turn_share * change)
        turns = np.arange(-most, most + 1e-9, options.turn_step).tolist()
        shares = [
            max(_same_share(ranges_at(table, np.array([one]), each + turn)[0], seen) for turn in turns)
            for each in (by_number, by_file)
        ]
        gains.append(shares[0] - shares[1])
    return min(gains) if min(gains) > 0.0 else max(gains)


def _same_share(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """The share of beams (B,) of two scans with nearly the same range; 0 for few."""
    known = np.isfinite(one) & np.isfinite(other)
    count = int(np.count_nonzero(known))
    near = np.abs(one[known] - other[known]) <= DirectionChangeOptions.same_range * other[known]
    return np.count_nonzero(near) / count if count >= DirectionChangeOptions.min_beams else 0.0
