"""Compile all kernels before the first log of a run, so that no log's time includes their compilation.

A process started by `bootstrap.py` maps a simulated drive through a square corridor with drifting
odometry. The drive has keyframes, joint matches and loops. One side is bare, so motion along it is uncertain.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

from nscan_cli.errors import InputDataError
from nscan_cli.kernels import machine_code
from nscan_cli.kernels.cache_folder import cache_folder
from nscan_cli.nightly import bootstrap

if TYPE_CHECKING:
    from nscan_cli.poses import Array

OUTER_WALL, INNER_WALL = 9.0, 6.0
"""Distance of the corridor's walls from its centre, m."""
LAPS, SCAN_SPACING, BEAMS = 1.4, 0.3, 181
"""Number of laps, distance between scans (m), and number of beams."""
LASER_RANGE, NO_RETURN, THREADS = 5.0, 81.91, 2
ODOMETRY_DRIFT = 0.004
"""Error of the heading from scan to scan, rad."""
TRACKING_KERNEL = "track_scans"
"""The kernel (slam/frontend/tracking_kernels.py) without whose machine code all kernels are compiled anew."""
COMPILED_FILE, LOCK_FILE = "all", ".compiling"
"""Files of the cache folder. The first, with a build key in its name, exists once kernels are compiled."""


def compile_kernels(environment: dict[str, str]) -> None:
    """Compile the kernels that the cache lacks, in a process of its own, once on each machine.

    Does nothing if no cache folder is writable. Errors are ignored here: the logs will report them.
    """
    folder = cache_folder()
    if folder is None or _is_compiled(folder):
        return
    with contextlib.suppress(OSError), (folder / LOCK_FILE).open("w") as lock:
        # Other processes wait here for the first one, and then find the kernels compiled.
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _is_compiled(folder):
            subprocess.run(
                bootstrap.worker_command("warm_up"), env=environment, check=False, stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
            )  # fmt: skip
            _compiled_file(folder).touch()


def cached_files() -> set[str]:
    """The files of the cache folder; a new one shows that a kernel was compiled."""
    folder = cache_folder()
    return set() if folder is None else {name for _, _, files in os.walk(folder) for name in files}


def _is_compiled(folder: Path) -> bool:
    """Whether the kernels were compiled and not deleted since."""
    return _compiled_file(folder).exists() and not machine_code.is_uncompiled(TRACKING_KERNEL)


def _compiled_file(folder: Path) -> Path:
    return folder / f"{COMPILED_FILE}-{machine_code.build_key()}"


def compile_here(folder: Path) -> None:
    """Compile the kernels that the cache folder lacks, in this process, for `nscan-cli warm-up`."""
    main()
    _compiled_file(folder).touch()


def main() -> None:
    """Map the simulated drive with and without odometry and as a turning laser, match and calibrate."""
    import numpy as np

    from nscan_cli.api import match, nscan
    from nscan_cli.calibration.options import CalibrationOptions
    from nscan_cli.calibration.robot_calibration import calibrate
    from nscan_cli.kernels import decorators as compiled
    from nscan_cli.logs.load import log_from
    from nscan_cli.logs.reading_options import ReadingOptions
    from nscan_cli.mapping.occupancy import occupancy_grid
    from nscan_cli.slam.log_to_graph import map_log, slam_options

    compiled.load_runtime()
    drive = simulated_carmen_log()
    short = ReadingOptions(end=20.0, odometry=False), ReadingOptions(end=20.0, sweep=0.2)
    for reading in (ReadingOptions(), *short):
        log = log_from(drive, "warm-up.log", reading)
        _, graph = map_log(log, reading, slam_options(None, None, True), THREADS, lambda *_progress: None)
        occupancy_grid(log, np.arange(len(log)), graph.poses, threads=THREADS)
    log = log_from(drive, "warm-up.log")
    match(log, 0, 2)
    # From so far off, the scans are placed by search.
    nscan(log, [0, 4, 8, 12], np.array([(0, 0, 0), (1.4, -1.4, 0.5), (-1.4, 1.2, -0.5), (0, 1.4, 0.5)]))
    # A drive of one lap may leave the robot open, but its kernels are compiled by then.
    with contextlib.suppress(InputDataError):
        calibrate(log, log.reading, CalibrationOptions())


def simulated_carmen_log() -> bytes:
    """The simulated drive as a CARMEN log."""
    import numpy as np

    from nscan_cli.poses import compose, relative

    poses = _simulated_poses()
    moves = relative(poses[1:], poses[:-1])
    moves[:, 2] += ODOMETRY_DRIFT
    robot = np.zeros(3)
    angles = np.radians(np.arange(BEAMS) - BEAMS // 2)
    lines = []
    for row, ranges in enumerate(_simulated_ranges(poses, angles)):
        robot = robot if row == 0 else compose(robot, moves[row - 1])
        pose = " ".join(f"{value:.6f}" for value in robot)
        values = " ".join(f"{value:.2f}" for value in ranges)
        lines.append(f"FLASER {BEAMS} {values} {pose} {pose} {0.5 * row:.3f} warm-up 0\n")
    return "".join(lines).encode()


def _simulated_poses() -> Array:
    """Poses (S, 3) along the middle of the corridor, turning on the spot at its corners."""
    import numpy as np

    from nscan_cli.poses import wrap

    half = (OUTER_WALL + INNER_WALL) / 2
    side = np.arange(-half, half, SCAN_SPACING)
    sides = int(np.ceil(4 * LAPS))
    poses = []
    for number in range(sides):
        heading = number * np.pi / 2
        cos, sin = np.cos(heading), np.sin(heading)
        along = np.array([(cos * x + sin * half, sin * x - cos * half, heading) for x in side])
        turns = heading + np.radians(np.arange(15, 90, 15))
        x, y = cos * half + sin * half, sin * half - cos * half
        poses += [along, np.array([(x, y, turn) for turn in turns])]
    drive = np.concatenate(poses)
    drive[:, 2] = wrap(drive[:, 2])
    return drive


def _simulated_ranges(poses: Array, angles: Array) -> Array:
    """Ranges (S, B) to the walls of the corridor, m; three of its sides have pillars."""
    import numpy as np

    walls = [*_square_walls(OUTER_WALL), *_square_walls(INNER_WALL)]
    for k in range(-8, 9, 2):
        walls += [((k, OUTER_WALL), (k, OUTER_WALL - 0.4)), ((OUTER_WALL, k), (OUTER_WALL - 0.4, k)),
                  ((-OUTER_WALL, k), (0.5 - OUTER_WALL, k + 0.3))]  # fmt: skip
    directions = poses[:, 2:] + angles
    x, y = np.cos(directions), np.sin(directions)
    nearest = np.full(directions.shape, NO_RETURN)
    for (ax, ay), (bx, by) in walls:
        across = x * (by - ay) - y * (bx - ax)
        along, left = ax - poses[:, :1], ay - poses[:, 1:2]
        with np.errstate(divide="ignore", invalid="ignore"):
            length = (along * (by - ay) - left * (bx - ax)) / across
            place = (along * y - left * x) / across
        meets = (length > 0.05) & (place >= 0) & (place <= 1)
        nearest = np.where(meets, np.minimum(nearest, length), nearest)
    return np.where(nearest > LASER_RANGE, NO_RETURN, nearest)


def _square_walls(half: float) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))
