"""The same work by others, where their wheels are installed: small_gicp for a match, GTSAM for a graph."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.whole_graph import optimise_graph
from nscan_cli.logs.load import read_log
from nscan_cli.matching.pairwise import PairOptions, match_pair, matched_points, scan_ndt
from nscan_cli.poses import Array
from tests.benchmarks.clock import Timing, best_of, median_of
from tests.data import OFFICE_LOG, find_data
from tests.graph.simulated_relations import disturbed, graph_of, mixed_ring

PAIRS, APART = 40, 5
"""Matches, of scans so many rows apart."""


def timings() -> Iterator[Timing]:
    """One by one; a line says which peer is missing."""
    yield from _matches()
    yield from _graphs()


def _matches() -> Iterator[Timing]:
    """From the pose that odometry gives to what converges, Gaussians or trees of both scans included."""
    log = read_log(OFFICE_LOG)
    rows = np.linspace(0, len(log) - 1 - APART, PAIRS).astype(np.int64).tolist()
    pairs = [tuple(matched_points(log, row + more, PairOptions()) for more in (0, APART)) for row in rows]
    yield Timing("match of two scans: nscan-cli", median_of([partial(_ours, *pair) for pair in pairs]))
    if importlib.util.find_spec("small_gicp") is None:
        print("small_gicp is not installed: its match is left out")
        return
    gicp: Any = importlib.import_module("small_gicp")
    yield Timing("match of two scans: small_gicp", median_of([partial(_gicp, gicp, *pair) for pair in pairs]))


def _ours(reference: Array, moving: Array) -> object:
    return match_pair(scan_ndt(reference, PairOptions()), moving, np.zeros(3), None, PairOptions())


def _gicp(gicp: Any, reference: Array, moving: Array) -> object:
    clouds = [np.column_stack([points, np.zeros(len(points))]) for points in (reference, moving)]
    return gicp.align(
        *clouds, registration_type="GICP", downsampling_resolution=0.05, max_correspondence_distance=1.0,
        num_threads=1,
    )  # fmt: skip


def _graphs() -> Iterator[Timing]:
    """From the poses in the file to the minimum, reading left out."""
    with TemporaryDirectory() as folder:
        truth, pairwise, nscan = mixed_ring(400, noise=1.0, seed=4)
        ring = Path(folder, "ring.g2o")
        ring.write_bytes(write_g2o(graph_of(disturbed(truth, 0.05), pairwise, nscan)))
        for path in (ring, find_data("intel.g2o")):
            if path is None:
                continue
            graph = load_graph(str(path))
            name, ours = f"graph optimisation, {path.stem}", partial(_optimised, graph)
            yield Timing(f"{name}: nscan-cli", best_of(ours, 3))
            if importlib.util.find_spec("gtsam") is None:
                print("gtsam is not installed: its optimisation is left out")
                continue
            gtsam: Any = importlib.import_module("gtsam")
            factors, poses = gtsam.readG2o(str(path), False)
            first = min(poses.keys())
            factors.add(gtsam.NonlinearEqualityPose2(first, poses.atPose2(first)))
            call = partial(_by_gtsam, gtsam, factors, poses)
            yield Timing(f"{name}: gtsam", best_of(call, 3))


def _optimised(graph: Graph) -> object:
    """From the poses given and from a chordal start, which GTSAM does not try."""
    return optimise_graph(replace(graph, poses=graph.poses.copy()))


def _by_gtsam(gtsam: Any, factors: Any, poses: Any) -> object:
    return gtsam.LevenbergMarquardtOptimizer(factors, poses, gtsam.LevenbergMarquardtParams()).optimize()
