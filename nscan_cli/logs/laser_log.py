"""The scans of one laser in order of time, as columns: what every reader of a log returns."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.provenance import Source
from nscan_cli.files.text import counted
from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.beam_mask import Bearings
from nscan_cli.logs.beam_times import BeamTimes, deskewed_points
from nscan_cli.logs.device_choice import Device
from nscan_cli.logs.frame_names import DEFAULT_FRAMES, FrameNames
from nscan_cli.logs.odometry_interpolation import moved_odometry
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import RobotPath, bent_path, likelier_path, robot_path
from nscan_cli.poses import Array, Indices, are_known, compose

SCANS_AT_ONCE = 256
"""Scans whose points are computed together."""


@dataclass(frozen=True)
class LogReport:
    """What the reader found in the log, for `info`."""

    records: dict[str, int] = field(default_factory=dict)
    """Number of records by tag."""
    skipped: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Number of skipped records and the place of the first, by reason."""
    skipped_place: str = "line"
    """What that place counts: "line", or "message" of its topic."""
    backward_stamps: int = 0
    """Number of steps back in time in file order. The scans are sorted stably."""
    warnings: tuple[str, ...] = ()
    """Sentences for the user."""
    used: dict[str, str] = field(default_factory=dict)
    """The reason for the choice of "laser", and the origin of "odometry", "mounting" and range limits."""
    lost: dict[str, int] = field(default_factory=dict)
    """Number of unusable readings by reason."""
    unusable: InputDataError | None = None
    """The error to raise if no reading is usable."""
    lasers: tuple[Device, ...] = ()
    """All lasers of the log, this one included."""
    laser_option: str = ""
    """The option that chooses a laser: "--laser" or "--topic"."""
    odometries: tuple[Device, ...] = ()
    """All odometries that --odom-topic can choose."""
    corrected: str = ""
    """The sign that the poses are the result of a mapper; empty if there is none."""
    masked: tuple[Bearings, ...] = ()
    """Sectors whose beams are not read, rad."""
    contradictions: tuple[str, ...] = ()
    """Sentences for the user: what of the log the scans contradict, and what was corrected."""

    def notices(self) -> list[str]:
        """The warnings, the contradictions, and one sentence for each reason of skipped records."""
        return [*self.warnings, *self.contradictions] + [
            f"{counted(count, 'record')} skipped: {reason}, first in {self.skipped_place} {first}"
            for reason, (count, first) in self.skipped.items()
        ]


@dataclass(frozen=True)
class LaserLog:
    """The scans of one laser, sorted stably by time; S scans of at most B beams.

    A row is a scan. `numbers` are the scan numbers that users see: positions in order of time in the
    whole log, independent of what `start`, `end` and `every` select.
    """

    source: Source
    format: str
    """Name of the form, such as "CARMEN"."""
    laser: str
    """Record tag or topic of the scans, such as "FLASER"."""
    numbers: NDArray[np.int64]
    """(S,) scan numbers, increasing."""
    stamps: tuple[str, ...]
    """S time stamps as written in the source."""
    times: Array
    """(S,) time of each scan, s."""
    ranges: NDArray[np.float32]
    """(S, B) distance from the laser, m; inf without return; nan if unusable (outside the range limits,
    an error code, or a beam that the scan does not have)."""
    angle_min: Array
    """(S,) direction of the first beam in the laser's frame, rad."""
    angle_increment: Array
    """(S,) angle from beam to beam, rad."""
    mount: Array
    """(3,) pose of the laser in the robot's frame."""
    odometry: Array | None
    """(S, 3) pose of the robot in the odometry frame, nan where it is missing; None without any odometry."""
    no_return: float | None
    """Smallest reading that means "no return", m; None if the log has none."""
    range_limits: tuple[float, float]
    """Range limits in force, m: a reading r is usable if min < r < max."""
    report: LogReport
    beams: NDArray[np.int64] | None = None
    """(S,) number of beams of each scan; None if all have B."""
    truth_times: Array | None = None
    """(T,) times of the true poses (TRUEPOS), s, or None."""
    truth: Array | None = None
    """(T, 3) true poses of the robot, or None."""
    frames: FrameNames = DEFAULT_FRAMES
    reading: ReadingOptions = field(default_factory=ReadingOptions)
    """The options that the log was read with."""
    beam_times: BeamTimes | None = None
    """The times of the beams of a laser that turns; None if each scan is seen at once."""
    odometry_path: RobotPath | None = None
    """The odometry at its own times, which tells more than the poses at the scans; None where it has no
    others, or there is none."""
    path: RobotPath | None = None
    """How the robot moves while the laser turns; None: as if it stood. See `moving_along`."""
    mapped_path: RobotPath | None = None
    """The path of a graph, which tells the motion between its poses best; None: not known."""

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def range_scale(self) -> float:
        """What the readings were multiplied by to be in metres, by an option or as they look."""
        return self.reading.range_scale or float(self.report.used.get("range_scale", "1"))

    def beam_counts(self) -> NDArray[np.int64]:
        """(S,) number of beams of each scan."""
        return beam_counts(self.ranges, self.beams)

    def readings(self, row: int) -> NDArray[np.float32]:
        """The readings (m) of one row, without those of beams that it does not have."""
        return self.ranges[row] if self.beams is None else self.ranges[row, : self.beams[row]]

    def row(self, number: int) -> int:
        """The row of a scan number. Raises WrongUsageError if the log has no such scan."""
        row = int(np.searchsorted(self.numbers, number))
        if row == len(self) or self.numbers[row] != number:
            first, last = (int(self.numbers[0]), int(self.numbers[-1]))
            raise WrongUsageError(
                f"{self.source.name}: no scan {number}; scans read go from {first} to {last}"
            )
        return row

    def points(self, scan: int) -> Array:
        """End points (m, 2) of the usable beams of one row in the robot's frame, in beam order."""
        points, _ = self.batch_points(slice(scan, scan + 1), math.inf)
        return points

    def points_by_scan(self) -> Iterator[Array]:
        """The `points` of each scan, in order of time."""
        for first in range(0, len(self), SCANS_AT_ONCE):
            points, ends = self.batch_points(slice(first, first + SCANS_AT_ONCE), math.inf)
            for begin, end in itertools.pairwise(ends.tolist()):
                yield points[begin:end]

    def batch_points(self, rows: slice, reach: float) -> tuple[Array, Indices]:
        """The points (m, 2) of R rows at once that are nearer to the robot than `reach` (m).

        Scan k of them has points[ends[k] : ends[k + 1]], with ends (R + 1,).
        """
        first, between = self.angle_min[rows], self.angle_increment[rows]
        if (first == first[0]).all() and (between == between[0]).all():
            # Mostly all scans have the same angles, and one row of cosines serves them all.
            first, between = first[:1], between[:1]
        angles = first[:, None] + between[:, None] * np.arange(self.ranges.shape[1])
        turn = np.array([np.cos(self.mount[2]), np.sin(self.mount[2])])
        if self.beam_times is not None and self.path is not None:
            laser = np.concatenate([self.mount[:2], turn])
            times, beams = self.times[rows], self.beam_times.of(rows)
            directions = np.cos(angles), np.sin(angles)
            return deskewed_points(self.ranges[rows], directions, laser, reach, times, beams, self.path)
        return _end_points(self.ranges[rows], np.cos(angles), np.sin(angles), self.mount, turn, reach)

    def timed_points(self, rows: slice, reach: float) -> tuple[Array, Indices, Array]:
        """The points and ends of batch_points, and the times (m,) of the points from their stamps, s."""
        points, ends = self.batch_points(rows, math.inf)
        near = np.hypot(points[:, 0], points[:, 1]) < reach
        points, ends = points[near], np.append(0, np.cumsum(near))[ends]
        if self.beam_times is None:
            return points, ends, np.zeros(len(points))
        beams = self.beam_times.of(rows)
        times = beams.first[:, None] + beams.step[:, None] * np.arange(self.ranges.shape[1])
        return points, ends, times[np.isfinite(self.ranges[rows])][near]

    def known_odometry(self) -> tuple[Array, Array]:
        """The times (P,), s, and known poses (P, 3) of the odometry, at its own times if there are any."""
        if self.odometry is None:
            return np.empty(0), np.empty((0, 3))
        path = self.odometry_path
        times, poses = (self.times, self.odometry) if path is None else (path.times, path.poses)
        known = np.flatnonzero(are_known(poses))
        return times[known], poses[known]

    @property
    def middle_times(self) -> Array:
        """(S,) times of the middle beams, s: what a scan tells is where the robot is then."""
        beams = self.beam_times
        return self.times if beams is None else self.times + beams.middles(self.beam_counts())

    def at_middle_of_sweeps(self) -> LaserLog:
        """The log with each scan at the time of its middle beam, and the odometry there, if the laser turns.

        How fast the robot moves then matters least for where a scan is: errors at its two ends cancel out.
        """
        if self.beam_times is None:
            return self
        middle = self.beam_times.middles(self.beam_counts())
        times, odometry, path = self.times + middle, self.odometry, self.odometry_path
        if odometry is not None:
            path = path or robot_path(self.times, odometry)
            if path is not None:
                odometry = moved_odometry(are_known(odometry), path, times)
        beams = BeamTimes(self.beam_times.first - middle, self.beam_times.step)
        return replace(self, times=times, odometry=odometry, odometry_path=path, beam_times=beams)

    def moving_along(self, poses: Array | None, rows: Indices | None = None) -> LaserLog:
        """The log with every beam seen from where the robot was, if the laser turns: `points` are corrected.

        `poses` (N, 3) are the robot's in some rows (N,), increasing, or in all; None: as far as odometry
        tells them. Between two of them it moves as on the mapped path; without one as odometry says, or
        steadily if that is likelier.
        """
        if self.beam_times is None:
            return self
        if poses is None:
            if self.odometry is None:
                return replace(self, path=None)
            return replace(self, path=self.odometry_path or robot_path(self.times, self.odometry))
        times = self.times if rows is None else self.times[rows]
        if self.mapped_path is not None:
            return replace(self, path=bent_path(self.mapped_path, times, poses))
        if self.odometry is None or self.odometry_path is None:
            return replace(self, path=robot_path(times, poses))
        return replace(self, path=likelier_path(self.odometry_path, times, poses))

    def laser_pose(self, robot: Array) -> Array:
        """Poses (…, 3) of the laser for poses (…, 3) of the robot."""
        return compose(robot, self.mount)


def beam_counts(ranges: NDArray[np.float32], beams: NDArray[np.int64] | None) -> NDArray[np.int64]:
    """(S,) number of beams of each scan with ranges (S, B): `beams` (S,), or B each if that is None."""
    return np.full(len(ranges), ranges.shape[1], dtype=np.int64) if beams is None else beams


@kernel
def _end_points(
    ranges: NDArray[np.float32], cos: Array, sin: Array, mount: Array, turn: Array, reach: float
) -> tuple[Array, Indices]:
    """Points and ends, as batch_points returns them, of ranges (R, B).

    `cos` and `sin` (1 or R, B) are those of the beams' directions, `turn` (2,) those of the mount (3,).
    """
    points, ends = np.empty((ranges.size, 2)), np.zeros(ranges.shape[0] + 1, dtype=np.int64)
    m = 0
    for row in range(ranges.shape[0]):
        angles = row if cos.shape[0] > 1 else 0
        for beam in range(ranges.shape[1]):
            length = np.float64(ranges[row, beam])
            if not np.isfinite(length):
                continue
            along, left = length * cos[angles, beam], length * sin[angles, beam]
            x = turn[0] * along - turn[1] * left + mount[0]
            y = turn[1] * along + turn[0] * left + mount[1]
            if np.hypot(x, y) < reach:
                points[m, 0], points[m, 1] = x, y
                m += 1
        ends[row + 1] = m
    return points[:m], ends
