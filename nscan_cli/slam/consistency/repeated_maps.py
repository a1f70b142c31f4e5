"""A drive mapped again, from a log that is changed in a way that must not change the map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from nscan_cli.calibration.changed_odometry import with_changed_odometry
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.log_excerpt import excerpt
from nscan_cli.poses import MIRRORED, Array, Indices
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState

WITHOUT_ODOMETRY = "without odometry"


@dataclass(frozen=True)
class MappedPath:
    """The path that one run found."""

    rows: Indices
    """(n,) rows of its scans in the log of the first run, increasing."""
    poses: Array
    """(n, 3)"""
    breaks: Indices
    """Rows before which its track broke."""
    notices: tuple[str, ...]
    """The notices of the run."""
    degenerate: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Rows of scans along bare walls, without odometry, that do not tell their places."""
    contradicted: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Rows of scans that fit those around them worse than on another path; see contradicted_rows.py."""
    has_odometry: bool = True
    """Whether its log had any."""

    def standing_rows(self, distance: float) -> Indices:
        """The first rows, without odometry, up to where the robot is this far (m) from where it began."""
        gone = np.hypot(*(self.poses[:, :2] - self.poses[0, :2]).T) > distance
        first = int(np.argmax(gone)) if gone.any() else len(gone)
        return self.rows[: 0 if self.has_odometry else first]


def mirrored(log: LaserLog) -> LaserLog:
    """The log of the mirror image of the world: the x axes are the mirror."""
    return replace(
        with_changed_odometry(log, lambda poses, _times: poses * MIRRORED),
        mount=log.mount * MIRRORED,
        angle_min=-log.angle_min,
        angle_increment=-log.angle_increment,
    )


def path_of(log: LaserLog, options: SlamOptions, rows: Indices | None = None) -> MappedPath:
    """Map a log, or its scans in `rows` (n,) alone."""
    rows = np.arange(len(log)) if rows is None else rows
    state = SlamState.of_log(log if len(rows) == len(log) else excerpt(log, rows), options)
    graph = run_slam(state, lambda *_counts: None)
    breaks = rows[np.array(state.breaks, dtype=np.int64)]
    degenerate = rows[state.degenerate_scans]
    said, has_odometry = tuple(notices(state)), log.odometry is not None
    return MappedPath(rows, graph.poses, breaks, said, degenerate, has_odometry=has_odometry)


def path_of_mirrored(log: LaserLog, options: SlamOptions) -> MappedPath:
    """Map the mirror image, and mirror the path back."""
    found = path_of(mirrored(log), options)
    return replace(found, poses=found.poses * MIRRORED)


def repeats(log: LaserLog) -> dict[str, Callable[[LaserLog, SlamOptions], MappedPath]]:
    """What to call the runs that have to give the same path, and how each is done."""
    runs: dict[str, Callable[[LaserLog, SlamOptions], MappedPath]] = {
        "every second scan": lambda log, options: path_of(log, options, np.arange(0, len(log), 2)),
        "the other scans": lambda log, options: path_of(log, options, np.arange(1, len(log), 2)),
        "mirrored": path_of_mirrored,
    }
    if log.odometry is not None:
        runs[WITHOUT_ODOMETRY] = lambda log, options: path_of(
            replace(log, odometry=None, odometry_path=None), options
        )
    return runs
