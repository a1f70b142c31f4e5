"""Logs for the SLAM loop, and what it makes of them: each is mapped once for all tests."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.provenance import as_parameters, provenance_of
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array
from nscan_cli.slam.backend.options import RefinementOptions
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import TrackedScan, TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.options import Relations, SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.data import OFFICE_LOG, data_file
from tests.logs.excerpts import truth_of


@dataclass(frozen=True)
class Mapped:
    """A log and its graph."""

    log: LaserLog
    graph: Graph
    state: SlamState
    """At the end of the loop."""

    def rmse(self) -> float:
        """Of the positions (m), after the best rigid motion."""
        return position_rmse(self.graph.poses, truth_of(self.log))


def mapped(log: LaserLog, options: SlamOptions | None = None, threads: int = 1) -> Mapped:
    """Run the loop over a log."""
    options = options or SlamOptions()
    state = SlamState.of_log(log, options, threads)
    graph = run_slam(state, lambda done, keyframes: None)
    parameters = {"reading": as_parameters(ReadingOptions()), "slam": as_parameters(options)}
    graph.provenance = provenance_of([log.source], parameters)
    return Mapped(log, graph, state)


@functools.cache
def office_log(odometry: bool = True) -> LaserLog:
    """The office sample, with its true poses."""
    return read_log(OFFICE_LOG, ReadingOptions(odometry=odometry))


@functools.cache
def mapped_office(odometry: bool, relations: Relations = "both", loops: bool = True) -> Mapped:
    """The office sample, mapped."""
    options = SlamOptions(nscan=NScanOptions(loops=loops), relations=relations)
    return mapped(office_log(odometry), options)


@functools.cache
def office_unrefined() -> Graph:
    """As the relations are found on the way: those of each keyframe with the ones before it."""
    return mapped(office_log(), SlamOptions(refinement=RefinementOptions(max_passes=0))).graph


@functools.cache
def mapped_real(name: str) -> Mapped:
    """A real log, mapped; the test is skipped where it is absent."""
    return mapped(read_log(str(data_file(f"{name}.log.gz"))))


def tracked(log: LaserLog, options: TrackingOptions | None = None) -> tuple[list[TrackedScan], Tracker]:
    """Step 1 alone, over a whole log."""
    tracker = Tracker(options or TrackingOptions())
    return scans_of(tracker.track(sensed_in(log))), tracker


def sensed(scans: Sequence[Array], odometry: Array | None = None) -> ScanBatch:
    """Scans with points (m, 2) each, as tracking takes them."""
    ends = np.cumsum([0, *map(len, scans)])
    times = np.arange(len(scans), dtype=np.float64)
    return ScanBatch(0, np.concatenate([np.empty((0, 2)), *scans]), ends, times, odometry)


def sensed_in(log: LaserLog) -> ScanBatch:
    """All scans of a log."""
    return sensed([log.points(row) for row in range(len(log))], log.odometry)


def scans_of(found: TrackedScans) -> list[TrackedScan]:
    """One by one."""
    return [found.scan(k) for k in range(len(found.paths))]


def found_of(*scans: TrackedScan) -> TrackedScans:
    """The same as columns; the objective's value is nobody's."""
    columns = {
        "poses": "pose",
        "hessians": "hessian",
        "prior_covariances": "prior_covariance",
        "inliers": "inliers",
        "paths": "path",
        "in_map": "in_map",
        "guess_variances": "guess_variances",
    }
    found = {name: np.array([getattr(scan, one) for scan in scans]) for name, one in columns.items()}
    nothing, zeros = np.full(len(scans), np.nan), np.zeros(len(scans))
    return TrackedScans(values=nothing, odometry_sigmas=zeros, weakest_sigmas=zeros, **found)


def poses_of(found: list[TrackedScan]) -> Array:
    """(S, 3)"""
    return np.array([scan.pose for scan in found])


def position_rmse(poses: Array, truth: Array) -> float:
    """The rmse (m) after the rigid motion that makes it least (Horn 1987, in the plane)."""
    if len(poses) < 2:
        return 0.0
    one, other = poses[:, :2] - poses[:, :2].mean(axis=0), truth[:, :2] - truth[:, :2].mean(axis=0)
    turn = np.arctan2(np.sum(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]), np.sum(one * other))
    c, s = np.cos(turn), np.sin(turn)
    off = one @ np.array([[c, s], [-s, c]]) - other
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
