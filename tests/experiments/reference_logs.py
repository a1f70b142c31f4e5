"""Real logs with reference poses of their scans, where the logs are there."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from nscan_cli.evaluation.reference_relations import read_relations
from nscan_cli.graph.model import Pairwise
from nscan_cli.graph.optimise.chordal import chordal_start
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import optimise_poses
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.scan_order import nearest_in_time
from nscan_cli.poses import Array
from tests.data import find_data

INFORMATION = np.diag([0.01**-2, 0.01**-2, 0.005**-2])
"""Of a reference relation: about as well (m, rad) as they agree with each other."""


@dataclass(frozen=True)
class ReferenceLog:
    """A log, and poses of some of its scans that agree with its reference relations."""

    log: LaserLog
    rows: NDArray[np.int64]
    """(K,) rows of the log, increasing."""
    poses: Array
    """(K, 3)"""


@functools.cache
def reference_log(name: str) -> ReferenceLog | None:
    """The log `name` with the poses that its relations (Kümmerle et al. 2009) give by least squares.

    Only the scans of the largest part that the relations connect have one. None where the log or its
    relations are not there.
    """
    log_path, relations_path = find_data(f"{name}.log.gz"), find_data(f"{name}.relations")
    if log_path is None or relations_path is None:
        return None
    log, relations = read_log(str(log_path)), read_relations(str(relations_path))
    times, ends = np.unique(relations.times, return_inverse=True)
    nodes = ends.reshape(-1, 2)
    part = _largest_part(nodes, len(times))
    positions = np.full(len(times), -1)
    positions[part] = np.arange(len(part))
    pairwise = [
        Pairwise((a, b), pose, INFORMATION, "loop")
        for (a, b), pose in zip(nodes.tolist(), relations.poses, strict=True)
        if positions[a] >= 0
    ]
    energy = GraphEnergy(len(part), pairwise, positions)
    poses = optimise_poses(energy, chordal_start(energy, np.zeros((len(part), 3)))).poses
    return ReferenceLog(log, nearest_in_time(log.times, times[part]), poses)


def _largest_part(nodes: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """The nodes of the largest component of the graph with these pairs (R, 2), increasing."""
    links = coo_array((np.ones(len(nodes)), (nodes[:, 0], nodes[:, 1])), shape=(count, count))
    labels = connected_components(links, directed=False)[1]
    return np.flatnonzero(labels == np.bincount(labels).argmax()).astype(np.int64)
