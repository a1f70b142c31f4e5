"""What a simulated robot records: true poses, odometry and readings, as CARMEN text or as a log in memory."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.provenance import Source
from nscan_cli.logs.laser_log import LaserLog, LogReport
from nscan_cli.poses import Array, compose
from tests.simulation.drive import Odometry, odometry
from tests.simulation.laser import Laser, measure
from tests.simulation.world import World

START = 1_000_000_000.0
"""Time stamp of the first scan, s."""


@dataclass(frozen=True)
class Recording:
    """One drive."""

    name: str
    laser: Laser
    times: Array
    """(S,) s from the first scan."""
    truth: Array
    """(S, 3) true poses of the robot."""
    odometry: Array
    """(S, 3), from (0, 0, 0) on."""
    readings: Array
    """(S, B) m, with the no-return value where nothing came back."""

    def carmen(self) -> bytes:
        """The drive as a CARMEN log: PARAM, then FLASER and TRUEPOS for every scan."""
        lines = [f"# {self.name}: simulated, not recorded"]
        mounts = ("offset", "side_offset", "angular_offset")
        for what, value in zip(mounts, self.laser.mount, strict=True):
            lines.append(f"PARAM robot_frontlaser_{what} {value:g} nohost 0")
        lasers = compose(self.odometry, np.array(self.laser.mount))
        for k, time in enumerate(self.times):
            trailer = f"{START + time:.6f} nohost {time:.6f}"
            ranges = " ".join([f"{reading:.2f}" for reading in self.readings[k].tolist()])
            lines.append(
                f"FLASER {self.laser.beams} {ranges} {_said(lasers[k])} {_said(self.odometry[k])} {trailer}"
            )
            lines.append(f"TRUEPOS {_said(self.truth[k])} {_said(self.odometry[k])} {trailer}")
        return ("\n".join(lines) + "\n").encode()

    def log(self) -> LaserLog:
        """The drive as a log in memory: as the reader would give it, but with nothing rounded."""
        data = self.readings.tobytes()
        size = len(self.times)
        ranges = self.readings.astype(np.float32)
        ranges[self.readings >= self.laser.no_return] = np.inf
        return LaserLog(
            source=Source(f"{self.name}.log", hashlib.sha256(data).hexdigest(), len(data)),
            format="simulated",
            laser="FLASER",
            numbers=np.arange(size),
            stamps=tuple(f"{START + time:.6f}" for time in self.times),
            times=START + self.times,
            ranges=ranges,
            angle_min=np.full(size, self.laser.angle_min),
            angle_increment=np.full(size, self.laser.angle_increment),
            mount=np.array(self.laser.mount),
            odometry=self.odometry.copy(),
            no_return=self.laser.no_return if np.isinf(ranges).any() else None,
            range_limits=(0.0, self.laser.no_return),
            report=LogReport(records={"FLASER": size}),
            truth_times=START + self.times,
            truth=self.truth.copy(),
        )


def record(
    name: str,
    world: World,
    truth: Array,
    laser: Laser,
    seed: int,
    errors: Odometry | None = None,
    period: float = 0.2,
) -> Recording:
    """What a robot at true poses (S, 3) records; the same for the same seed."""
    rng = np.random.Generator(np.random.PCG64(seed))
    return Recording(
        name,
        laser,
        np.arange(len(truth), dtype=np.float64) * period,
        truth,
        odometry(truth, errors or Odometry(), rng),
        measure(world, truth, laser, rng),
    )


def _said(pose: Array) -> str:
    return " ".join(f"{value + 0.0:.6f}" for value in pose)
