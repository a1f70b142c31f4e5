"""When the beams of a scan were measured, and deskewing: where they end if the robot moved meanwhile."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.robot_path import RobotPath, along_arc, interval_at, seen_from
from nscan_cli.poses import Array, Indices


class BeamTimes(NamedTuple):
    """The times of the beams of S scans, from the stamp of each scan."""

    first: Array
    """(S,) time of the first beam, s."""
    step: Array
    """(S,) time from beam to beam, s; negative where the readings are in the reverse order of time."""

    def of(self, rows: slice | Indices) -> BeamTimes:
        """The times of the beams of some scans."""
        return BeamTimes(self.first[rows], self.step[rows])

    def middles(self, beams: NDArray[np.int64]) -> Array:
        """(S,) times of the middle beams, s, of scans with so many `beams` (S,)."""
        return self.first + 0.5 * (beams - 1) * self.step


@kernel
def deskewed_points(
    ranges: NDArray[np.float32],
    directions: tuple[Array, Array],
    laser: Array,
    reach: float,
    stamps: Array,
    beams: BeamTimes,
    path: RobotPath,
) -> tuple[Array, Indices]:
    """Deskewed points (m, 2) of ranges (R, B) in the robot's frame at the stamp: each from where it was.

    `directions` are the cosines and the sines of the beams (1 or R, B). `laser` (4,) is its pose on the
    robot: x, y, cosine and sine. Scan k, stamped at stamps[k] (s), has points[ends[k] : ends[k + 1]], with
    ends (R + 1,). Points from `reach` (m) on are left out.
    """
    cos, sin = directions
    points, ends = np.empty((ranges.size, 2)), np.zeros(ranges.shape[0] + 1, dtype=np.int64)
    origin, at_stamp, arc = np.array([0.0, 0.0, 1.0, 0.0]), np.empty(4), np.empty(4)
    m, j, nearer = 0, 0, reach * reach
    c, s, turned_cos, turned_sin = 1.0, 0.0, 1.0, 0.0
    for row in range(ranges.shape[0]):
        angles = row if cos.shape[0] > 1 else 0
        j = interval_at(path.times, stamps[row], j)
        seen_from(path, origin, stamps[row], j, at_stamp)
        of_arc = -1
        for beam in range(ranges.shape[1]):
            time = stamps[row] + beams.first[row] + beam * beams.step[row]
            j = interval_at(path.times, time, j)
            seconds, rate = time - path.times[j], path.twists[j, 2]
            if j == of_arc:
                # The robot turns by the same from beam to beam, so no beam needs a sine of its own.
                c, s = c * turned_cos - s * turned_sin, s * turned_cos + c * turned_sin
            else:
                of_arc = j
                c, s = np.cos(rate * seconds), np.sin(rate * seconds)
                turned_cos, turned_sin = np.cos(rate * beams.step[row]), np.sin(rate * beams.step[row])
                seen_from(path, at_stamp, path.times[j], j, arc)
            length = np.float64(ranges[row, beam])
            if not np.isfinite(length):
                continue
            along, left = length * cos[angles, beam], length * sin[angles, beam]
            x = laser[2] * along - laser[3] * left + laser[0]
            y = laser[3] * along + laser[2] * left + laser[1]
            ahead, aside = along_arc(rate, seconds, c, s)
            dx = c * x - s * y + ahead * path.twists[j, 0] - aside * path.twists[j, 1]
            dy = s * x + c * y + aside * path.twists[j, 0] + ahead * path.twists[j, 1]
            x, y = arc[2] * dx - arc[3] * dy + arc[0], arc[3] * dx + arc[2] * dy + arc[1]
            if x * x + y * y < nearer:
                points[m, 0], points[m, 1] = x, y
                m += 1
        ends[row + 1] = m
    return points[:m], ends
