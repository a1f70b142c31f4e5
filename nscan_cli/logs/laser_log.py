"""What every reader of a log yields: the scans of one laser in order of time, as columns."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.counting import counted
from nscan_cli.files.source import Source
from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.device_choice import Device
from nscan_cli.logs.frame_names import DEFAULT_FRAMES, FrameNames
from nscan_cli.poses import Array, Indices, compose

SCANS_AT_ONCE = 256
"""Scans whose points are computed at once."""


@dataclass(frozen=True)
class LogReport:
    """What the reader found and did; `info` prints it."""

    records: dict[str, int] = field(default_factory=dict)
    """Records by their tag."""
    skipped: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Reason → (how many records were skipped for it, line of the first)."""
    skipped_place: str = "line"
    """What the first is counted in: "line", or "message" of its topic."""
    backward_stamps: int = 0
    """Steps back in time in file order; the scans are sorted stably all the same."""
    warnings: tuple[str, ...] = ()
    """Whole sentences for the user."""
    used: dict[str, str] = field(default_factory=dict)
    """Why it is this "laser", and where "odometry", "mounting", "range_min" and "range_max" are from."""
    lost: dict[str, int] = field(default_factory=dict)
    """Why a reading is none that counts → how many there are of them."""
    unusable: InputDataError | None = None
    """What is wrong when no reading at all counts."""
    lasers: tuple[Device, ...] = ()
    """All that the log has, this one too."""
    laser_option: str = ""
    """What chooses one of them: "--laser" or "--topic"."""
    odometries: tuple[Device, ...] = ()
    """All that --odom-topic can choose."""
    corrected: str = ""
    """What tells that the log's poses are a mapper's result; empty where nothing does."""

    def notices(self) -> list[str]:
        """The warnings, and what was skipped, for commands that do not list it."""
        return [*self.warnings] + [
            f"{counted(count, 'record')} skipped: {reason}, first in {self.skipped_place} {first}"
            for reason, (count, first) in self.skipped.items()
        ]


@dataclass(frozen=True)
class LaserLog:
    """The scans of one laser, sorted stably by time; S scans of at most B beams.

    A row is a scan. `numbers` are the scan numbers that users see: positions in order of time in the
    whole log, so that they stay the same whatever `start`, `end` and `every` select.
    """

    source: Source
    format: str
    """Such as "CARMEN"."""
    laser: str
    """The record tag or topic that the scans come from, such as "FLASER"."""
    numbers: NDArray[np.int64]
    """(S,) scan numbers, increasing."""
    stamps: tuple[str, ...]
    """S time stamps as the source wrote them."""
    times: Array
    """(S,) seconds."""
    ranges: NDArray[np.float32]
    """(S, B) metres from the laser; inf where a beam met nothing, nan where it says nothing
    (outside the range limits, an error code, or a beam that this scan does not have)."""
    angle_min: Array
    """(S,) direction of the first beam in the laser's frame, rad."""
    angle_increment: Array
    """(S,) rad from beam to beam."""
    mount: Array
    """(3,) pose of the laser in the robot's frame."""
    odometry: Array | None
    """(S, 3) pose of the robot in the odometry frame, or None."""
    no_return: float | None
    """The least value (m) that was taken for "no return", or None when the log has none."""
    range_limits: tuple[float, float]
    """The effective range limits (m): a beam counts when min < r < max."""
    report: LogReport
    beams: NDArray[np.int64] | None = None
    """(S,) how many beams each scan has; None: all have B."""
    truth_times: Array | None = None
    """(T,) seconds of the true poses (TRUEPOS), or None."""
    truth: Array | None = None
    """(T, 3) true poses of the robot, or None."""
    frames: FrameNames = DEFAULT_FRAMES

    def __len__(self) -> int:
        return len(self.stamps)

    def beam_counts(self) -> NDArray[np.int64]:
        """(S,) how many beams each scan has."""
        if self.beams is not None:
            return self.beams
        return np.full(len(self), self.ranges.shape[1], dtype=np.int64)

    def readings(self, row: int) -> NDArray[np.float32]:
        """The ranges (m) of one row's own beams."""
        return self.ranges[row] if self.beams is None else self.ranges[row, : self.beams[row]]

    def row(self, number: int) -> int:
        """The row of a scan number. Raises WrongUsageError when the log has no such scan."""
        row = int(np.searchsorted(self.numbers, number))
        if row == len(self) or self.numbers[row] != number:
            first, last = (int(self.numbers[0]), int(self.numbers[-1]))
            raise WrongUsageError(
                f"{self.source.name}: no scan {number}; scans read go from {first} to {last}"
            )
        return row

    def points(self, scan: int) -> Array:
        """The usable beams' end points (m, 2) of one row in the robot's frame, in beam order."""
        points, _ = self.batch_points(slice(scan, scan + 1), math.inf)
        return points

    def points_by_scan(self) -> Iterator[Array]:
        """The `points` of each scan, in order of time."""
        for points, ends in self.point_batches(SCANS_AT_ONCE):
            for begin, end in itertools.pairwise(ends.tolist()):
                yield points[begin:end]

    def point_batches(self, size: int, reach: float = math.inf) -> Iterator[tuple[Array, Indices]]:
        """The `points` (m, 2) of `size` scans at a time that are nearer to the robot than `reach` (m).

        One scan after another; ends (n + 1,) tell that scan k has points[ends[k] : ends[k + 1]].
        """
        for first in range(0, len(self), size):
            yield self.batch_points(slice(first, first + size), reach)

    def batch_points(self, rows: slice, reach: float) -> tuple[Array, Indices]:
        """The points (m, 2) of R rows, one after another, and where each row's end, as in stretches."""
        first, between = self.angle_min[rows], self.angle_increment[rows]
        if (first == first[0]).all() and (between == between[0]).all():
            # Mostly all scans have the same angles: a scan's cosines do for all.
            first, between = first[:1], between[:1]
        angles = first[:, None] + between[:, None] * np.arange(self.ranges.shape[1])
        turn = np.array([np.cos(self.mount[2]), np.sin(self.mount[2])])
        return _end_points(self.ranges[rows], np.cos(angles), np.sin(angles), self.mount, turn, reach)

    def laser_pose(self, robot: Array) -> Array:
        """Poses (…, 3) of the laser for poses (…, 3) of the robot."""
        return compose(robot, self.mount)


@kernel
def _end_points(
    ranges: NDArray[np.float32], cos: Array, sin: Array, mount: Array, turn: Array, reach: float
) -> tuple[Array, Indices]:
    """What _points returns of ranges (R, B) in directions of these cosines and sines (1 or R, B).

    `turn` (2,) are those of the mount (3,).
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
