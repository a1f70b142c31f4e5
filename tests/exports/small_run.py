"""A small log with its graph, as slam would give them, made by hand."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose
from tests.mapping.handmade_logs import log_of

POSES: Array = np.array(
    [[0.0, 0.0, 0.0], [0.5, 0.1, 0.3], [1.0, 0.3, -3.0], [1.5, 0.2, 3.14], [2.0, 0.0, 1.0]]
)
STAMPS = ("976052896.784509", "976052897.784509001", "976052898.25", "976052899", "976052899.5")


def small_log(**changes: Any) -> LaserLog:
    """Five scans of 181 beams on a robot whose odometry drifts; beam 3 met nothing, beam 4 says nothing."""
    ranges = np.random.default_rng(5).uniform(1, 8, size=(5, 181)).astype(np.float32)
    ranges[:, 3], ranges[:, 4] = np.inf, np.nan
    log = log_of(ranges, -np.pi / 2, np.pi / 180, (0.2, -0.01, 0.05))
    drift = np.array([[0.01 * k, -0.02 * k, 0.003 * k] for k in range(5)])
    return dataclasses.replace(
        log,
        stamps=STAMPS,
        times=np.array([float(stamp) for stamp in STAMPS]),
        odometry=compose(drift, POSES),
        no_return=81.83,
        **changes,
    )


def small_run_graph(log: LaserLog) -> Graph:
    """Scans 0, 2, 4 are keyframes, with relations of three kinds."""
    local = POSES[[0, 2, 4]]
    return Graph(
        scans=log.numbers,
        stamps=list(log.stamps),
        poses=POSES,
        odometry=log.odometry,
        anchors=np.array([0, 0, 2, 2, 4]),
        pairwise=[
            Pairwise((0, 2), POSES[2], np.eye(3), "track"),
            Pairwise((0, 4), POSES[4], np.eye(3), "loop"),
        ],
        nscan=[NScan((0, 2, 4), local, np.eye(9), 1, "nscan")],
    )
