"""How the laser moves while it takes a scan, by the scans before and after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from nscan_cli.calibration.scan_turns import scan_turns
from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.calibration.sweep_options import ScanTurnOptions, SweepCheckOptions, SweepTimeOptions
from nscan_cli.calibration.thinned_scans import thinned_scan
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import move_along_arc
from nscan_cli.matching.scan_pairs import match_scans
from nscan_cli.poses import Array, Indices


@dataclass(frozen=True)
class ScanMotion:
    """The scans of a log as its laser sees them, without odometry, and what was measured of their motion."""

    log: LaserLog
    """The log, whose scans are taken as seen at once, from the laser."""
    steps: StepOptions
    longest_step: float
    """Longest time from a scan to the next, s, over which motion is measured."""
    turns: ScanTurnOptions
    _points: dict[int, tuple[Array, Array] | None] = field(default_factory=dict)
    _velocities: dict[int, Array | None] = field(default_factory=dict)
    _rates: dict[int, float] = field(default_factory=dict)

    @staticmethod
    def of_log(log: LaserLog, steps: StepOptions, options: SweepCheckOptions) -> ScanMotion:
        """The scans of a robot's log, before any motion is measured."""
        seen = replace(log, mount=np.zeros(3), path=None)
        return ScanMotion(seen, steps, options.longest_step, options.scan_turns)

    def rates(self, rows: Indices) -> Array:
        """(n,) rad/s; about how fast the laser turns at rows (n,) with a scan on both sides; 0 at a gap."""
        new = np.array([row for row in np.unique(rows).tolist() if row not in self._rates], dtype=np.int64)
        seconds = self.log.times[new + 1] - self.log.times[new - 1]
        is_measured = (seconds > 0.0) & (seconds <= 2 * self.longest_step)
        # Nothing turns between like scans, as in a file that repeats one.
        is_measured &= (self.log.ranges[new - 1] != self.log.ranges[new + 1]).any(axis=1)
        rates, those = np.zeros(len(new)), new[is_measured]
        if len(those):
            rates[is_measured] = scan_turns(self.log, those - 1, those + 1, self.turns) / seconds[is_measured]
        self._rates.update(zip(new.tolist(), rates.tolist(), strict=True))
        return np.array([self._rates[row] for row in rows.tolist()])

    def spread_rows(self, options: SweepCheckOptions, scans: int) -> Indices:
        """Rows (n,) of so many scans that are spread over the log, or fewer, with a scan on both sides."""
        count = min(scans, len(self.log) // options.scans_apart)
        return np.unique(np.linspace(1, max(len(self.log) - 2, 1), count).astype(np.int64))

    def rows_beside(self, rows: Indices, most: int) -> Indices:
        """Other rows (n,) up to so many scans from rows, with a scan on both sides: a turn of the robot
        takes longer than a scan, so those beside one in a turn are likely in it, too."""
        near = np.unique((rows[:, None] + np.arange(-most, most + 1)).ravel())
        inside: Indices = near[(near >= 1) & (near <= len(self.log) - 2)]
        return np.setdiff1d(inside, rows)

    def turning_rows(self, rows: Indices, sweep: float, options: SweepCheckOptions) -> Indices:
        """Those of rows in which the robot turns enough during a `sweep` of the laser (s), the fastest
        first."""
        rates = np.abs(self.rates(rows))
        order = np.argsort(-rates, kind="stable")
        fastest: Indices = rows[order[rates[order] * sweep > options.min_winding]]
        return fastest

    def twist(self, row: int) -> Array | None:
        """(3,) velocity of the laser at a row, m/s and rad/s, by the scans on both sides; None in doubt."""
        both = self._on_both_sides(row)
        return None if both is None else 0.5 * (both[0] + both[1])

    def change_of_turn(self, one: int, other: int) -> float:
        """rad/s; by how much the laser turns faster at one row than at another, by matches; 0 in doubt."""
        before, after = self.twist(one), self.twist(other)
        return 0.0 if before is None or after is None else abs(float(after[2] - before[2]))

    def unsteadiness(self, row: int, options: SweepTimeOptions) -> float:
        """The share by which the rate of the laser's turn changes from before a row to after it; inf in
        doubt."""
        both = self._on_both_sides(row)
        if both is None:
            return float(np.inf)
        before, after = float(both[0][2]), float(both[1][2])
        return abs(after - before) / max(abs(before), abs(after), options.slow)

    def _on_both_sides(self, row: int) -> tuple[Array, Array] | None:
        """The velocities (3,) from the scan before, and to the next one; None in doubt."""
        before = self._velocity(row - 1)
        after = None if before is None else self._velocity(row)
        return None if before is None or after is None else (before, after)

    def _velocity(self, row: int) -> Array | None:
        """(3,) velocity of the laser from a row to the next, m/s and rad/s; None in doubt."""
        if row not in self._velocities:
            self._velocities[row] = self._measured(row)
        return self._velocities[row]

    def _measured(self, row: int) -> Array | None:
        seconds = float(self.log.times[row + 1] - self.log.times[row])
        reference, scan = self._scan(row), self._scan(row + 1)
        if not 0.0 < seconds <= self.longest_step or reference is None or scan is None:
            return None
        # A step is about as long as the one before it. Of a first one the ranges tell the turn.
        before = self._velocities.get(row - 1)
        if before is None:
            before = np.array([0.0, 0.0, self._rates.get(row + 1, 0.0)])
        start = before * seconds
        end = match_scans(reference[0], scan[0], start, self.steps.pair)
        if not end.converged or end.overlap < self.steps.min_overlap:
            return None
        return end.pose / seconds

    def corrected(self, row: int, sweep: float) -> Array | None:
        """Points (m, 2) of a scan from where the laser is at its middle beam, if a `sweep` takes so long (s).

        None in doubt.
        """
        scan, twist = self._scan(row), self.twist(row) if 0 < row < len(self.log) - 1 else None
        if scan is None or twist is None:
            return None
        # The velocities are those of steps, which an arc turns by half of their own turn.
        seconds = 0.5 * float(self.log.times[row + 1] - self.log.times[row - 1])
        points = scan[0].copy()
        move_along_arc(points, scan[1] * (sweep / seconds), twist * seconds, False)
        return points

    def turned(self, row: int, sweep: float) -> float | None:
        """rad; how far the laser turns from the scan before a row to the one after it, by corrected scans.

        None in doubt.
        """
        before, at, after = (self.corrected(each, sweep) for each in (row - 1, row, row + 1))
        twist = self.twist(row)
        if before is None or at is None or after is None or twist is None:
            return None
        seconds = np.diff(self.log.times[row - 1 : row + 2]).tolist()
        # Its twist was measured by matches of these scans.
        ends = [
            match_scans(reference, points, twist * time, self.steps.pair, is_near=True)
            for reference, points, time in ((before, at, seconds[0]), (at, after, seconds[1]))
        ]
        return float(sum(end.pose[2] for end in ends)) if all(end.converged for end in ends) else None

    def energies(self, one: int, other: int, sweeps: Sequence[float]) -> Array | None:
        """(T,) energy of two scans, per point, for each assumed time of a sweep (T,), s; None in doubt."""
        before, after = self.twist(one), self.twist(other)
        if before is None or after is None:
            return None
        way = 0.5 * (before + after) * float(self.log.times[other] - self.log.times[one])
        found, ends = np.empty(len(sweeps)), dict[float, Array]()
        # A match with a far too long time may slip, and the next ones that begin where it ended, too.
        for k in np.argsort(np.abs(sweeps), kind="stable").tolist():
            sweep = sweeps[k]
            first, second = self.corrected(one, sweep), self.corrected(other, sweep)
            if first is None or second is None:
                return None
            start = ends[min(ends, key=lambda done: abs(done - sweep))] if ends else way
            end = match_scans(first, second, start, self.steps.pair, is_near=bool(ends))
            found[k], ends[sweep] = end.energy / len(second), end.pose
        return found

    def _scan(self, row: int) -> tuple[Array, Array] | None:
        """Points (m, 2) of a scan, and when each (m,) was measured from the middle beam on, in sweeps.

        None with too few points.
        """
        if row not in self._points:
            self._points[row] = self._thinned(row)
        return self._points[row]

    def _thinned(self, row: int) -> tuple[Array, Array] | None:
        scan = thinned_scan(self.log, row, self.steps)
        if scan is None:
            return None
        increment = abs(self.log.angle_increment[row])
        middle = 0.5 * (len(self.log.readings(row)) - 1)
        return scan.points, (scan.beams - middle) * increment / (2 * np.pi)
