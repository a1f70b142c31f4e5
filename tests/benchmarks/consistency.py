"""Maps of the same drive that must be the same: `python -m tests.benchmarks.consistency OUT.md [LOG ...]`.

Every recording in NSCAN_DATA is mapped with every scan, every second and every third one, mirrored, and
backwards in time; with odometry and without. Faults of the file that its scans show, such as a wrong
direction of the laser's turn, are corrected first, as in `slam`. No truth is needed, because the drive is
the same. The table has how much the distances that the robot came in windows of 6 s differ between the
runs, at stamps that all of them have.
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.errors import NscanError
from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import MIRRORED, Array, relative
from nscan_cli.slam.consistency.repeated_maps import mirrored
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import SlamOptions
from tests.data import REAL_LOGS
from tests.experiments.output import table
from tests.logs.excerpts import excerpt

WINDOW = 6.0
"""Length of a window, s."""
NEAR, TURNED = 0.3, np.radians(15)
"""Windows in which scans of the sparsest run are farther apart (m, rad) are left out: they may be lost."""
RECORDINGS = ("*.log.gz", "*.mcap", "field/*.bag", "field/*.log", "field/*.db3", "field/rplidar-floor")


@dataclass(frozen=True)
class MappedPath:
    """The path that one run found."""

    times: Array
    """(S,) s"""
    poses: Array
    """(S, 3)"""
    breaks: int
    told: bool
    """Whether a notice says that something is wrong."""


def backwards(log: LaserLog) -> LaserLog:
    """The log read from its end to its beginning."""
    times = (log.times[0] + log.times[-1] - log.times)[::-1]
    found = dataclasses.replace(excerpt(log, slice(None, None, -1)), times=times, odometry_path=None)
    beams = found.beam_times
    if beams is None:
        return found
    return dataclasses.replace(found, beam_times=BeamTimes(-beams.first, -beams.step))


def mapped_path(path: str, every: int, change: str, odometry: bool) -> MappedPath | None:
    """The path of a recording, changed in one way; None where there is nothing to map."""
    reading = ReadingOptions(every=every, odometry=odometry)
    try:
        log = read_log(path, reading)
    except NscanError:
        return None
    if odometry and log.odometry is None:
        return None
    checked = checked_file(log, reading, FileCheckOptions())
    log = {"": lambda log: log, "mirrored": mirrored, "backwards": backwards}[change](checked.log)
    drive = map_drive(log, SlamOptions(), reading=checked.reading, has_findings=checked.has_findings)
    times, poses = np.asarray(log.times), drive.graph.poses
    if change == "mirrored":
        poses = poses * MIRRORED
    if change == "backwards":
        times, poses = (log.times[0] + log.times[-1] - log.times)[::-1], poses[::-1]
    return MappedPath(times, poses, len(drive.state.breaks), bool(notices(drive.state)))


def differences(runs: Sequence[MappedPath]) -> tuple[float, float, float]:
    """How far the distances over the windows differ, and where: 95 % quantile, greatest (m), its time (s).

    The last of the runs is the sparsest one. nan where no window can be compared.
    """
    stamps = [np.round(run.times, 6) for run in runs]
    common = stamps[0]
    for each in stamps[1:]:
        common = np.intersect1d(common, each)
    paths = [run.poses[np.searchsorted(each, common)] for run, each in zip(runs, stamps, strict=True)]
    steps = relative(runs[-1].poses[1:], runs[-1].poses[:-1])
    apart = (np.hypot(steps[:, 0], steps[:, 1]) > NEAR) | (np.abs(steps[:, 2]) > TURNED)
    gaps = runs[-1].times[1:][apart]
    ends = np.searchsorted(common, common + WINDOW, side="right") - 1
    whole = (common[ends] - common > 0.5 * WINDOW) & (
        np.searchsorted(gaps, common[ends], side="right") == np.searchsorted(gaps, common, side="right")
    )
    if not whole.any():
        return float("nan"), float("nan"), float("nan")
    ways = np.array([np.linalg.norm(path[ends, :2] - path[:, :2], axis=1) for path in paths])
    apart_by = np.where(whole, np.ptp(ways, axis=0), 0.0)
    worst = int(apart_by.argmax())
    at = float(common[worst] - common[0])
    return float(np.quantile(apart_by[whole], 0.95)), float(apart_by[worst]), at


def row(path: str, odometry: bool) -> list[str] | None:
    """The line of one recording in the table."""
    name = Path(path).name
    runs = [mapped_path(path, every, "", odometry) for every in (1, 2, 3)]
    first = runs[0]
    if first is None or any(run is None for run in runs):
        return None
    found = [run for run in runs if run is not None]
    cells = [name, "yes" if odometry else "no"]
    changed = [mapped_path(path, 1, change, odometry) for change in ("mirrored", "backwards")]
    for others in (found, *([first, run] for run in changed if run is not None)):
        quantile, greatest, at = differences(others)
        cells += [f"{quantile:.3f}", f"{greatest:.3f} at {at:.0f} s"] if np.isfinite(at) else ["–", "–"]
    cells.append(", ".join(str(run.breaks) for run in found))
    cells.append("yes" if any(run.told for run in found) else "no")
    return cells


def main(out: str, names: Sequence[str]) -> None:
    """Write the table as Markdown."""
    folder = Path(os.environ.get("NSCAN_DATA", REAL_LOGS))
    paths = sorted(str(path) for pattern in RECORDINGS for path in folder.glob(pattern))
    paths = [path for path in paths if not names or Path(path).name in names]
    jobs = [(path, odometry) for path in paths for odometry in (True, False)]
    with ProcessPoolExecutor(2) as pool:
        rows = [cells for cells in pool.map(row, *zip(*jobs, strict=True)) if cells is not None]
    header = ["recording", "odometry"]
    for way in ("every 1, 2, 3", "mirrored", "backwards"):
        header += [f"{way}: 95 %, m", "greatest, m"]
    lines = table((*header, "breaks", "told"), rows)
    document = (__doc__ or "").replace(
        "`python -m tests.benchmarks.consistency OUT.md [LOG ...]`", "`make consistency`"
    )
    Path(out).write_text(f"# Consistency\n\n{document}\n{lines}\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
