"""Drives with a laser that turns, against one that sees at once: `python -m tests.benchmarks.turning_drives`.

Root mean square error of the positions, and largest error of a heading, with and without odometry. With
stamps at the middle or last beam the file still says that they are at the first one, and is checked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.evaluation.alignment import alignment
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import compose, wrap
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.benchmarks.laser_kinds import turning
from tests.experiments.output import table
from tests.logs.excerpts import truth_of
from tests.simulation.drive import Drive
from tests.simulation.office import office_way, office_world
from tests.simulation.sweeping import Turning, fine_path, record_swept

WAY_POINTS = 7
SPEED = 0.22
"""m/s"""


@dataclass(frozen=True)
class TurningDrive:
    """A robot that turns at a rate (rad/s), with a laser that takes a scan in every `period` (s)."""

    period: float
    rate: float

    def log(self, turn: float, stamp: str, odometry: bool) -> LaserLog:
        """With a laser whose turn takes so long (s). The file says that it is stamped at the first beam."""
        path = fine_path(office_way()[:WAY_POINTS], Drive(speed=SPEED, turn_rate=self.rate))
        laser = turning(360, 3.5, 0.01, 0.01)
        log = record_swept("office", office_world(), path, laser, Turning(self.period, turn, stamp), 1).log(
            stamp="first"
        )
        return log if odometry else replace(log, odometry=None, odometry_path=None)


DRIVES = (TurningDrive(0.2, 0.5), TurningDrive(0.2, 1.5), TurningDrive(0.2, 2.8), TurningDrive(0.1, 1.0))


def errors(log: LaserLog) -> str:
    """Root mean square error of the positions and the largest of a heading, of the log as `slam` reads it."""
    log = checked_file(log, ReadingOptions(), FileCheckOptions()).log
    poses = run_slam(SlamState.of_log(log, SlamOptions()), lambda scans, keyframes: None).poses
    truth = truth_of(log)
    off = compose(alignment(poses, truth).motion, poses) - truth
    rms = float(np.sqrt((off[:, :2] ** 2).sum(axis=1).mean()))
    return f"{1e3 * rms:.1f} mm, {np.degrees(np.abs(wrap(off[:, 2])).max()):.2f}°"


def main() -> None:
    """Print the tables of docs/accuracy.md."""
    rows, stamped = [], []
    for drive in DRIVES:
        name, turn = f"{1 / drive.period:.0f} Hz, {drive.rate} rad/s", drive.period
        cases = [(each, odometry) for odometry in (True, False) for each in (0.0, turn)]
        rows.append((name, *(errors(drive.log(each, "first", odometry)) for each, odometry in cases)))
        stamped.append((name, *(errors(drive.log(turn, stamp, True)) for stamp in ("middle", "last"))))
    columns = ("at once", "turning", "at once, no odometry", "turning, no odometry")
    print(table(("laser, turn rate of the robot", *columns), rows))
    print(
        table(("laser, turn rate of the robot", "stamps at the middle", "stamps at the last beam"), stamped)
    )


if __name__ == "__main__":
    main()
