"""How long a laser turns, as its scans tell: they fit best if every beam is seen from where the robot was.

A scan of a robot that turns is wound up or unwound by its motion during the turn of the laser; one of a robot
that stands is not. Two scans that were taken while the robot moved differently fit best with the true time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.options import StepOptions, SweepCheckOptions
from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import move_along_arc
from nscan_cli.matching.pairwise import PairMatch, match_pair, matched_points, scan_ndt
from nscan_cli.poses import Array, Indices

LEAST_PAIRS = 5
"""With fewer their spread says little of their mean."""


@dataclass(frozen=True)
class SweepEvidence:
    """What pairs of scans say of times of a turn."""

    turns: Array
    """(T,) the times that were tried, s; negative: readings in the reverse order of time."""
    energies: Array
    """(P, T) energy of each of P pairs matched with each time, per point; smaller is sharper."""
    rows: Indices
    """(n,) rows of scans whose motion was measured, by the scans before and after."""
    twists: Array
    """(n, 3) that motion of the laser, m/s and rad/s."""

    def sigmas(self, better: float, worse: float) -> float:
        """By how many standard deviations one of the times fits better than another; 0 with too few pairs."""
        places = [int(np.argmin(np.abs(self.turns - turn))) for turn in (better, worse)]
        gains = self.energies[:, places[1]] - self.energies[:, places[0]]
        if len(gains) < LEAST_PAIRS:
            return 0.0
        spread = float(gains.std(ddof=1)) / np.sqrt(len(gains))
        return float(gains.mean()) / max(float(spread), 1e-12)

    @property
    def sharpest(self) -> float:
        """The time with the least energy of all pairs, s."""
        return float(self.turns[int(np.argmin(self.energies.sum(axis=0)))])


def sweep_evidence(
    log: LaserLog, turns: Sequence[float], steps: StepOptions, options: SweepCheckOptions
) -> SweepEvidence:
    """What the scans of a log say of some times of a turn, s, without its odometry and times of beams."""
    at_laser = replace(log, mount=np.zeros(3), path=None)
    first, second, twists = _pairs(at_laser, max(abs(turn) for turn in turns), steps, options)
    energies = []
    for one, other in zip(first.tolist(), second.tolist(), strict=True):
        try:
            both = [_points_and_places(at_laser, row, steps) for row in (one, other)]
        except InputDataError:
            continue
        pair = [twists[one], twists[other]]
        way = np.mean(pair, axis=0) * float(log.times[other] - log.times[one])
        energies.append([_energy(both, pair, way, turn, steps) for turn in turns])
    rows = np.array(sorted(twists), dtype=np.int64)
    motion = np.array([twists[row] for row in rows.tolist()]).reshape(-1, 3)
    return SweepEvidence(np.array(turns), np.array(energies).reshape(-1, len(turns)), rows, motion)


def _pairs(
    log: LaserLog, turn: float, steps: StepOptions, options: SweepCheckOptions
) -> tuple[Indices, Indices, dict[int, Array]]:
    """Rows (P,) of two scans each between which the motion has changed, and the twists at these rows."""
    count = min(options.scans, len(log) // options.scans_apart)
    centres = np.unique(np.linspace(1, max(len(log) - 2, 1), count).astype(np.int64))
    twists = _twists(log, centres, steps, options)
    rates = {row: abs(float(twist[2])) for row, twist in twists.items()}
    turning = [row for row in rates if rates[row] * turn > options.min_winding]
    fast = sorted(turning, key=lambda row: -rates[row])
    partners = [row + shift for row in fast for shift in options.shifts if 1 <= row + shift <= len(log) - 2]
    twists |= _twists(log, np.unique(np.array(partners, dtype=np.int64)), steps, options)
    found = [
        (row, row + shift)
        for row in fast
        for shift in options.shifts
        if row + shift in twists
        and abs(float(twists[row + shift][2] - twists[row][2])) * turn > options.min_winding
        and abs(float(twists[row + shift][2] + twists[row][2]))
        * 0.5
        * abs(float(log.times[row + shift] - log.times[row]))
        <= options.max_apart
    ]
    pairs = np.array(found[: options.pairs], dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1], twists


def _twists(log: LaserLog, rows: Indices, steps: StepOptions, options: SweepCheckOptions) -> dict[int, Array]:
    """Row → velocity (3,) of the laser there, m/s and rad/s, by the scans on both sides of it."""
    found = {}
    for row in rows.tolist():
        velocities: list[Array] = []
        for begin in (row - 1, row):
            seconds = float(log.times[begin + 1] - log.times[begin])
            # A step is about as long as the one before it.
            start = velocities[-1] * seconds if velocities else np.zeros(3)
            match = _matched(log, begin, start, steps) if 0.0 < seconds <= options.longest_step else None
            if match is None or not match.converged or match.overlap < steps.min_overlap:
                break
            velocities.append(match.pose / seconds)
        else:
            found[row] = np.mean(velocities, axis=0)
    return found


def _matched(log: LaserLog, begin: int, start: Array, steps: StepOptions) -> PairMatch | None:
    """The scan after that in row `begin`, matched with it from `start` (3,); None with too few points."""
    try:
        (reference, _), (points, _) = (_points_and_places(log, begin + by, steps) for by in (0, 1))
    except InputDataError:
        return None
    return match_pair(scan_ndt(reference, steps.pair), points, start, None, steps.pair)


def _points_and_places(log: LaserLog, row: int, steps: StepOptions) -> tuple[Array, Array]:
    """Points (m, 2) of a scan, and where in a turn (m,) each was measured, in turns from the middle beam."""
    ranges = log.ranges[row]
    points = matched_points(log, row, steps.pair)
    beams = np.flatnonzero(np.isfinite(ranges) & (ranges <= steps.pair.reach))
    places = (beams - 0.5 * (len(log.readings(row)) - 1)) * abs(log.angle_increment[row]) / (2 * np.pi)
    every = max(len(ranges) // steps.max_beams, 1)
    return points[::every].copy(), places[::every].copy()


def _energy(
    both: Sequence[tuple[Array, Array]], twists: Sequence[Array], way: Array, turn: float, steps: StepOptions
) -> float:
    """The energy of two scans about a way (3,) apart, per point, if the turn of the laser takes so long."""
    one, other = (points.copy() for points, _ in both)
    for points, (_, places), twist in zip((one, other), both, twists, strict=True):
        move_along_arc(points, places * turn, twist, False)
    match = match_pair(scan_ndt(one, steps.pair), other, way, None, steps.pair)
    return match.energy / len(other)
