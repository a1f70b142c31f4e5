"""Runs that need all kernels, so that they compile them, in parts for processes side by side.

A kernel that two parts need is compiled in one of them (kernels/compile_lock.py). So each part needs first
what the other comes to last, and neither waits long.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.logs.reading_options import ReadingOptions

THREADS, SCANS_PER_KEYFRAME = 2, 5
FOR_ALL = (("track", "search", "others"), ("refine", "turn"))
"""The parts with all kernels, for two processes that take about as long."""


def for_slam(log: LaserLog) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The parts with the kernels that `slam` needs for a log, but for rare ones, for two processes."""
    return (
        ("track",) if log.odometry is not None else ("track", "search"),
        ("refine",) if log.beam_times is None else ("refine", "turn"),
    )


def main(*parts: str) -> None:
    """Run some parts. A process started by `bootstrap.py` does so."""
    from nscan_cli.kernels.decorators import load_runtime
    from nscan_cli.kernels.whole_kernels import rare_collections

    exercises = {"track": _track, "refine": _refine, "search": _search, "turn": _turn, "others": _others}
    load_runtime()
    with rare_collections():
        for part in parts:
            exercises[part]()


def _track() -> None:
    """Map the drive from its first scan to the last."""
    import numpy as np

    from nscan_cli.calibration.scan_turns import scan_turns
    from nscan_cli.calibration.sweep_options import ScanTurnOptions
    from nscan_cli.logs.load import log_from
    from nscan_cli.logs.reading_options import ReadingOptions
    from nscan_cli.slam.log_to_graph import map_log, slam_options
    from nscan_cli.warm_up.simulated_drive import simulated_carmen_log

    log = log_from(simulated_carmen_log(), "warm-up.log")
    # For headings that stand, and lasers that turn.
    scan_turns(log, np.zeros(1, dtype=np.int64), np.ones(1, dtype=np.int64), ScanTurnOptions())
    map_log(log, ReadingOptions(), slam_options(), THREADS, lambda *_progress: None)


def _refine() -> None:
    """Optimise the graph of the drive, draw its map, match its keyframes jointly, and close its loops."""
    import numpy as np

    from nscan_cli.graph.marginal_covariances import marginal_covariances
    from nscan_cli.graph.optimise.whole_graph import optimise_graph
    from nscan_cli.logs.load import log_from
    from nscan_cli.mapping.occupancy import occupancy_grid
    from nscan_cli.slam.backend.finish import finish_graph
    from nscan_cli.slam.backend.loop_rejection import reject_contradicting_loops
    from nscan_cli.slam.backend.refinement import refine
    from nscan_cli.slam.backend.resume import state_of_graph
    from nscan_cli.slam.backend.subgraph import nearest_keyframes
    from nscan_cli.slam.diagnostics.notices import notices
    from nscan_cli.slam.log_to_graph import slam_options
    from nscan_cli.slam.loop_closure.most_certain_paths import relations_on_paths
    from nscan_cli.warm_up.simulated_drive import simulated_carmen_log

    graph = _drive_graph()
    optimise_graph(graph)
    marginal_covariances(graph)
    log = log_from(simulated_carmen_log(), "warm-up.log")
    rows = np.arange(len(log))
    occupancy_grid(log, rows, graph.poses, threads=THREADS)
    state = state_of_graph(graph, log, slam_options(), THREADS)
    for relation, length in zip(state.chain, np.diff(state.route.paths).tolist(), strict=True):
        state.detector.extend(relation, length)
    reject_contradicting_loops(state)
    refine(state)
    finish_graph(state)
    notices(state)
    # For graphs of more than 500 keyframes.
    relations_on_paths(np.zeros(1, dtype=np.int64), nearest_keyframes(np.zeros((1, 3)), 0, 1, 1))


def _drive_graph() -> Graph:
    """A graph of the drive with a keyframe every 1.5 m and a relation of each type."""
    import numpy as np

    from nscan_cli.files.provenance import as_parameters
    from nscan_cli.graph.model import Graph, NScan, Pairwise
    from nscan_cli.poses import relative
    from nscan_cli.slam.log_to_graph import slam_options
    from nscan_cli.warm_up.simulated_drive import simulated_poses

    poses = simulated_poses()
    rows = np.arange(len(poses))
    anchors = rows - rows % SCANS_PER_KEYFRAME
    graph = Graph(rows, [f"{row}.0" for row in rows], poses, None, anchors)
    graph.provenance["parameters"] = {"slam": as_parameters(slam_options())}
    keyframes = graph.keyframes
    for first, second in zip(keyframes[:-1].tolist(), keyframes[1:].tolist(), strict=True):
        step = relative(poses[second], poses[first])
        graph.add(Pairwise((first, second), step, 1e4 * np.eye(3), "track", 1.0))
    first, second, third = keyframes[:3].tolist()
    around = relative(poses[[first, second, third]], poses[second])
    graph.add(NScan((first, second, third), around, 1e4 * np.eye(9), 1, "nscan", 1.0))
    return graph


def _search() -> None:
    """Map the beginning of the drive without odometry, which looks for lost scans."""
    from nscan_cli.logs.reading_options import ReadingOptions

    _map_beginning(ReadingOptions(odometry=False))


def _turn() -> None:
    """Map the beginning of the drive as that of a turning laser whose motion counts as uneven everywhere."""
    from dataclasses import replace

    import numpy as np

    from nscan_cli.logs.reading_options import ReadingOptions
    from nscan_cli.logs.robot_path import move_along_arc
    from nscan_cli.slam.log_to_graph import slam_options

    move_along_arc(np.zeros((1, 2)), np.zeros(1), np.zeros(3), False)
    uneven = replace(slam_options().uneven_motion, min_change=0.0)
    _map_beginning(ReadingOptions(sweep=0.2), uneven_motion=uneven)


def _map_beginning(reading: ReadingOptions, **changed: Any) -> None:
    from dataclasses import replace

    import numpy as np

    from nscan_cli.logs.load import log_from
    from nscan_cli.mapping.occupancy import occupancy_grid
    from nscan_cli.slam.log_to_graph import map_log, slam_options
    from nscan_cli.warm_up.simulated_drive import simulated_carmen_log

    reading = replace(reading, end=20.0)
    log = log_from(simulated_carmen_log(), "warm-up.log", reading)
    options = replace(slam_options(), **changed)
    _, graph = map_log(log, reading, options, THREADS, lambda *_progress: None)
    occupancy_grid(log, np.arange(len(log)), graph.poses, threads=THREADS)


def _others() -> None:
    """What `calibrate`, `match` and `nscan` need, and `slam` with a relation for each pair of scans."""
    import numpy as np

    from nscan_cli.api import match, nscan
    from nscan_cli.calibration.options import CalibrationOptions
    from nscan_cli.calibration.robot_calibration import calibrate
    from nscan_cli.errors import InputDataError
    from nscan_cli.logs.load import log_from
    from nscan_cli.logs.reading_options import ReadingOptions
    from nscan_cli.warm_up.simulated_drive import simulated_carmen_log

    log = log_from(simulated_carmen_log(), "warm-up.log")
    match(log, 0, 2)
    nscan(log, [0, 1, 2])
    # From so far off, the scans are placed by search.
    nscan(log, [0, 4, 8, 12], np.array([(0, 0, 0), (1.4, -1.4, 0.5), (-1.4, 1.2, -0.5), (0, 1.4, 0.5)]))
    # A drive of one lap may leave the robot open, but its kernels are compiled by then.
    with contextlib.suppress(InputDataError):
        calibrate(log, log.reading, CalibrationOptions())
    _map_beginning(ReadingOptions(), relations="pairwise")
