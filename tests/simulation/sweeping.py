"""A laser that turns while the robot drives: beam after beam is cast from where the robot is then."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.provenance import Source
from nscan_cli.logs.laser_log import LaserLog, LogReport
from nscan_cli.logs.robot_path import RobotPath, poses_at, robot_path
from nscan_cli.logs.sweep import beam_times
from nscan_cli.poses import Array, compose
from tests.simulation.building import cells_of, follow
from tests.simulation.drive import Drive, Odometry, odometry, poses
from tests.simulation.laser import Laser, with_errors
from tests.simulation.recording import START
from tests.simulation.world import World

STEP = 0.01
"""s between true poses."""
ODOMETRY_PERIOD = 0.05
"""s"""
WHOLE_TURN = 2 * np.pi


@dataclass(frozen=True)
class Turning:
    """How a laser turns."""

    period: float = 0.2
    """s between scans."""
    turn: float = 0.2
    """s for 360°; negative: the readings come in the reverse order of time; 0: all beams at once."""
    stamp: str = "first"


@dataclass(frozen=True)
class SweptRecording:
    """One drive with such a laser."""

    name: str
    laser: Laser
    turning: Turning
    times: Array
    """(S,) the stamps, s."""
    truth: Array
    """(S, 3) true poses at the stamps."""
    odometry: RobotPath
    """At its own times."""
    readings: Array
    """(S, B) m"""

    def log(self, turn: float | None = None, stamp: str | None = None) -> LaserLog:
        """The drive as a log in memory; of another turn (s) or stamp than the true ones if they are given."""
        turn = self.turning.turn if turn is None else turn
        size, data = len(self.times), self.readings.tobytes()
        ranges = self.readings.astype(np.float32)
        ranges[self.readings >= self.laser.no_return] = np.inf
        increments = np.full(size, self.laser.angle_increment)
        beams = beam_times(
            np.full(size, turn), increments, np.full(size, self.laser.beams), stamp or self.turning.stamp
        )
        return LaserLog(
            source=Source(f"{self.name}.log", hashlib.sha256(data).hexdigest(), len(data)),
            format="simulated",
            laser="scan",
            numbers=np.arange(size),
            stamps=tuple(f"{time:.6f}" for time in self.times),
            times=self.times,
            ranges=ranges,
            angle_min=np.full(size, self.laser.angle_min),
            angle_increment=increments,
            mount=np.array(self.laser.mount),
            odometry=poses_at(self.odometry, self.times),
            no_return=self.laser.no_return if np.isinf(ranges).any() else None,
            range_limits=(0.0, self.laser.no_return),
            report=LogReport(records={"scan": size}),
            truth_times=self.times,
            truth=self.truth.copy(),
            beam_times=beams,
            odometry_path=None if beams is None else self.odometry,
        )


def fine_path(waypoints: Array, how: Drive) -> RobotPath:
    """The true path along way points (W, 2); the period of `how` is not used."""
    through = poses(waypoints, Drive(how.speed, how.turn_rate, STEP, how.reach))
    path = robot_path(START + STEP * np.arange(len(through), dtype=np.float64), through)
    assert path is not None
    return path


def record_swept(
    name: str,
    world: World,
    path: RobotPath,
    laser: Laser,
    turning: Turning,
    seed: int,
    errors: Odometry | None = None,
) -> SweptRecording:
    """What a robot on a true path records; the same for the same seed. Pillars of the world are not seen."""
    rng = np.random.Generator(np.random.PCG64(seed))
    margin = abs(turning.turn)
    stamps = np.arange(path.times[0] + margin, path.times[-1] - margin, turning.period)
    size = len(stamps)
    at = np.tile(stamps[:, None], (1, laser.beams))
    beams = beam_times(
        np.full(size, turning.turn),
        np.full(size, laser.angle_increment),
        np.full(size, laser.beams),
        turning.stamp,
    )
    if beams is not None:
        at += beams.first[:, None] + beams.step[:, None] * np.arange(laser.beams)
    origins = compose(poses_at(path, at.ravel()), np.array(laser.mount))
    origins[:, 2] += np.tile(laser.angles(), size)
    seen = follow(cells_of(world), origins, np.zeros(1), laser.max_range)
    ranges, incidence = (column.reshape(size, laser.beams) for column in seen)
    readings = with_errors(ranges, incidence, np.zeros(1), laser, rng)
    every = round(ODOMETRY_PERIOD / STEP)
    by_wheels = robot_path(path.times[::every], odometry(path.poses[::every], errors or Odometry(), rng))
    assert by_wheels is not None
    return SweptRecording(name, laser, turning, stamps, poses_at(path, stamps), by_wheels, readings)
