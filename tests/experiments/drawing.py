"""Random matching problems: scans of one place, and starts with a given error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.overlap import overlaps, weakest_link
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.pairwise import matched_points, scan_ndt
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, relative, wrap
from tests.experiments.reference_logs import ReferenceLog
from tests.matching.problems import OPTIONS
from tests.simulation.scenes import Scene

SIZES = (3, 4, 5, 6, 7, 8, 9, 10)
"""Scans of a problem, in turn."""
ERROR, TURN = (0.1, 1.5), (np.radians(2.0), np.radians(30.0))
"""The least and the greatest error (m, rad) of a start."""
GAP = (0.3, 1.2)
"""Along the path from scan to scan, m; a turn of a radian counts half a metre."""
PLACE, APART = 3.0, 0.3
"""Greatest distance (m) of a problem's scans from one of them, and least distance between two."""


@dataclass(frozen=True)
class Drawn:
    """One problem."""

    points: list[Array]
    ndts: list[Ndt]
    truth: Array
    """(n, 3)"""
    start: Array
    """(n, 3)"""
    error: float
    """Error (m) of the start of every scan. The error of the angle is in proportion."""
    link: float
    """The least overlap on the tree of greatest overlaps at the true poses."""


def draw_simulated(scene: Scene, count: int, seed: int) -> list[Drawn]:
    """Problems from a simulated drive."""
    log = scene.record(seed).log()
    assert log.truth is not None
    return _draw(log, np.arange(len(log)), log.truth, count, seed)


def draw_real(reference: ReferenceLog, count: int, seed: int) -> list[Drawn]:
    """Problems from the scans of a log that have a reference pose."""
    return _draw(reference.log, reference.rows, reference.poses, count, seed)


def _draw(log: LaserLog, rows: NDArray[np.int64], poses: Array, count: int, seed: int) -> list[Drawn]:
    rng = np.random.Generator(np.random.PCG64(seed))
    steps = np.diff(poses, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1]) + 0.5 * np.abs(wrap(steps[:, 2]))
    path = np.concatenate([[0.0], np.cumsum(lengths)])
    drawn: list[Drawn] = []
    while len(drawn) < count:
        n = SIZES[len(drawn) % len(SIZES)]
        # Half of them along the path, half from one place at any time.
        along = len(drawn) // len(SIZES) % 2 == 0
        chosen = _along(rng, path, n) if along else _about(rng, poses, n)
        size = rng.uniform()
        error, turn = (low + size * (high - low) for low, high in (ERROR, TURN))
        where, sign = rng.uniform(0.0, 2 * np.pi, n), rng.choice([-1.0, 1.0], n)
        if chosen is None:
            continue
        off = np.stack([error * np.cos(where), error * np.sin(where), turn * sign], axis=1)
        try:
            points = [matched_points(log, int(row), OPTIONS) for row in rows[chosen]]
        except InputDataError:
            continue
        ndts, truth = [scan_ndt(part, OPTIONS) for part in points], poses[chosen]
        link = weakest_link(overlaps(scan_set(ndts, points), truth, JointOptions.inlier_bound).pairs)
        drawn.append(Drawn(points, ndts, truth, truth + off, float(error), link))
    return drawn


def _along(rng: np.random.Generator, path: Array, n: int) -> NDArray[np.int64] | None:
    """Scans at equal distances on the path."""
    gap = rng.uniform(*GAP)
    first = rng.uniform(0.0, max(path[-1] - gap * n, 0.0))
    chosen = np.searchsorted(path, first + gap * np.arange(n))
    return chosen if chosen[-1] < len(path) and len(np.unique(chosen)) == n else None


def _about(rng: np.random.Generator, poses: Array, n: int) -> NDArray[np.int64] | None:
    """Scans near a random one, in order of time."""
    centre = rng.integers(len(poses))
    near = np.flatnonzero(np.hypot(*(poses[:, :2] - poses[centre, :2]).T) < PLACE)
    chosen: list[int] = []
    for candidate in rng.permutation(near).tolist():
        off = relative(poses[chosen], poses[candidate])
        if (np.hypot(off[:, 0], off[:, 1]) + 0.5 * np.abs(wrap(off[:, 2])) > APART).all():
            chosen.append(candidate)
        if len(chosen) == n:
            return np.sort(np.array(chosen))
    return None
