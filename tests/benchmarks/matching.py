"""How long matches take, on one core and after compilation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import get_args

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.matching.joint.index_set import IndexSetKind
from nscan_cli.matching.joint.joint_energy import JointProblem, all_pairs, joint_energy, no_priors
from nscan_cli.matching.joint.nscan_match import nscan_match
from nscan_cli.matching.joint.odometry_priors import odometry_priors
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.motion_model import MotionModel
from nscan_cli.matching.pairwise import PairOptions, match_pair, matched_points, scan_ndt
from nscan_cli.poses import Array, relative
from tests.benchmarks.clock import Timing, median_of
from tests.data import OFFICE_LOG, find_data

CASES, SEED = 40, 1
SPACING = 0.5
"""m of odometry from scan to scan."""


def timings() -> Iterator[Timing]:
    """One by one."""
    for name, path in (("office", Path(OFFICE_LOG)), ("intel", find_data("intel.log.gz"))):
        if path is None:
            continue
        log = read_log(str(path))
        ten, six, two = (list(_windows(log, n)) for n in (10, 6, 2))
        yield Timing(f"{name}: joint energy of 10 scans, all pairs", median_of(_energies(log, ten)))
        for n, windows in ((10, ten), (6, six)):
            for kind in get_args(IndexSetKind):
                calls = [partial(_joint, log, window, kind) for window in windows]
                yield Timing(f"{name}: joint match of {n} scans, pairs: {kind}", median_of(calls))
        calls = [partial(_pair, log, window) for window in two]
        yield Timing(f"{name}: pairwise match from odometry", median_of(calls))


def _windows(log: LaserLog, n: int) -> Iterator[Array]:
    """Rows of n scans, by chance but always the same."""
    assert log.odometry is not None
    steps = np.hypot(*np.diff(log.odometry[:, :2], axis=0).T)
    path = np.concatenate([[0.0], np.cumsum(steps)])
    rng = np.random.Generator(np.random.PCG64(SEED))
    for first in rng.uniform(0.0, path[-1] - n * SPACING, CASES):
        yield np.searchsorted(path, first + SPACING * np.arange(n))


def _energies(log: LaserLog, windows: list[Array]) -> list[Callable[[], object]]:
    assert log.odometry is not None
    calls: list[Callable[[], object]] = []
    for rows in windows:
        points = [matched_points(log, int(row), PairOptions()) for row in rows]
        scans = scan_set([scan_ndt(part, PairOptions()) for part in points], points)
        problem = JointProblem(scans, all_pairs(len(rows)), no_priors(), 1.0)
        calls.append(partial(joint_energy, problem, log.odometry[rows]))
    return calls


def _joint(log: LaserLog, rows: Array, pairs: IndexSetKind) -> object:
    """All that `nscan` does from the odometry once the log is read."""
    assert log.odometry is not None
    odometry = log.odometry[rows]
    points = [matched_points(log, int(row), PairOptions()) for row in rows]
    priors = odometry_priors(odometry, rows.tolist(), MotionModel())
    return nscan_match(points, odometry, priors, 0, PairOptions(), JointOptions(), pairs)


def _pair(log: LaserLog, rows: Array) -> object:
    assert log.odometry is not None
    first, second = (matched_points(log, int(row), PairOptions()) for row in rows)
    start = relative(log.odometry[rows[1]], log.odometry[rows[0]])
    return match_pair(scan_ndt(first, PairOptions()), second, start, None, PairOptions())
