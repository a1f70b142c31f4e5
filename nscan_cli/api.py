"""The public functions for Python that no other module has, re-exported by `nscan_cli`: docs/python.md.

They do what the commands do, on objects in place of files. Modules are imported within the functions, so that
`import nscan_cli` costs nothing.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

from nscan_cli.errors import WrongUsageError

if TYPE_CHECKING:
    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.mapping.occupancy import OccupancyGrid
    from nscan_cli.matching.joint.nscan_match import NScanMatch
    from nscan_cli.matching.joint.outliers import ExcludedScan
    from nscan_cli.matching.pairwise import PairMatch
    from nscan_cli.poses import Array
    from nscan_cli.slam.options import SlamOptions


def build_graph(log: LaserLog, options: SlamOptions | None = None, threads: int | None = None) -> Graph:
    """The pose graph of a log, as `nscan-cli slam` makes it.

    `threads` is by default the number of processors; the result does not depend on it. What `slam` would
    print as warnings is in the graph's `provenance["notices"]`.
    """
    from nscan_cli.kernels.decorators import load_runtime
    from nscan_cli.slam.log_to_graph import map_log
    from nscan_cli.slam.options import SlamOptions
    from nscan_cli.threads import available_threads

    load_runtime()
    threads = threads or available_threads()
    return map_log(log, log.reading, options or SlamOptions(), threads, lambda *_progress: None)[1]


def match(
    log: LaserLog, reference: int, scan: int, initial: Array | None = None, odometry: bool = True
) -> PairMatch:
    """The pose of a scan in the frame of another, with its covariance, as `nscan-cli match` finds it.

    `reference` and `scan` are scan numbers. `initial` (3,) is the initial pose (m, m, rad); by default it
    comes from odometry, or is 0 without any. `odometry` says whether odometry is a prior, too. Raises
    WrongUsageError if the log has no such scan.
    """
    import numpy as np

    from nscan_cli.matching.motion_model import MotionModel, odometry_prior
    from nscan_cli.matching.pairwise import PairOptions, match_pair, matched_points, scan_ndt

    log = log.moving_along(None)
    options, rows = PairOptions(), [log.row(reference), log.row(scan)]
    known = _known_odometry(log, rows)
    prior = None if known is None else odometry_prior(known[0], known[1], MotionModel())
    start = np.zeros(3) if prior is None else prior.mean
    fixed, moving = (matched_points(log, row, options) for row in rows)
    chosen = start if initial is None else np.asarray(initial, dtype=float)
    return match_pair(scan_ndt(fixed, options), moving, chosen, prior if odometry else None, options)


def nscan(
    log: LaserLog, scans: Sequence[int], initial: Array | None = None, odometry: bool = True
) -> tuple[NScanMatch | None, list[ExcludedScan]]:
    """The joint match of n scans, as `nscan-cli nscan` finds it, and the scans that it leaves out.

    `scans` are scan numbers, of which the result has indices. `initial` (n, 3) and `odometry` are as for
    `match`. The match is None if no two scans match. Raises WrongUsageError if the log has no such scan.
    """
    import numpy as np

    from nscan_cli.matching.joint.nscan_match import nscan_match
    from nscan_cli.matching.joint.odometry_priors import odometry_priors
    from nscan_cli.matching.joint.options import JointOptions
    from nscan_cli.matching.motion_model import MotionModel
    from nscan_cli.matching.pairwise import PairOptions, matched_points
    from nscan_cli.poses import relative

    log = log.moving_along(None)
    options, rows = PairOptions(), [log.row(number) for number in scans]
    known = _known_odometry(log, rows)
    start = np.zeros((len(rows), 3)) if known is None else relative(known, known[0])
    points = [matched_points(log, row, options) for row in rows]
    priors = odometry_priors(known if odometry else None, scans, MotionModel())
    chosen = start if initial is None else np.asarray(initial, dtype=float)
    return nscan_match(points, chosen, priors, 0, options, JointOptions())


def save_graph(graph: Graph, path: str) -> None:
    """Write a graph as JSON (docs/graph.md). Raises OutputError if the file cannot be written."""
    from nscan_cli.files.outputs import write_atomically
    from nscan_cli.graph.io.json_graph import write_graph

    write_atomically(path, write_graph(graph))


def make_grid(log: LaserLog, graph: Graph, resolution: float = 0.05) -> OccupancyGrid:
    """The occupancy grid of a graph and its log, with cells of `resolution` (m), as `render` draws it.

    Raises WrongUsageError if the log lacks a scan of the graph, or if the grid would be too large.
    """
    import numpy as np

    from nscan_cli.mapping.occupancy import occupancy_grid
    from nscan_cli.threads import available_threads

    rows = np.minimum(np.searchsorted(log.numbers, graph.scans), len(log) - 1)
    if not (log.numbers[rows] == graph.scans).all():
        raise WrongUsageError(
            f"{log.source.name}: lacks scans of the graph; read the log that the graph was made from"
        )
    log = dataclasses.replace(log, mapped_path=graph.path)
    return occupancy_grid(log, rows, graph.poses, resolution, available_threads())


def _known_odometry(log: LaserLog, rows: Sequence[int]) -> Array | None:
    """The odometry (n, 3) of the scans in `rows`; None if one of them has none."""
    from nscan_cli.poses import are_known

    if log.odometry is None or not are_known(log.odometry[rows]).all():
        return None
    return log.odometry[rows]
