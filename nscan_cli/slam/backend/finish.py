"""The graph of a finished loop: the poses of all scans, the relations, and how certain the poses are."""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.marginal_covariances import marginal_covariances
from nscan_cli.graph.model import Graph
from nscan_cli.logs.robot_path import bent_path
from nscan_cli.slam.backend.degenerate_relations import widened_relations
from nscan_cli.slam.backend.scan_poses import between_keyframes
from nscan_cli.slam.backend.single_scan_jumps import without_single_jumps
from nscan_cli.slam.state import SlamState


def finish_graph(state: SlamState) -> Graph:
    """The graph of all scans, with marginal covariances. Changes nothing but the cache of energies."""
    state.energies.forget()
    log, rows = state.log, state.route.rows
    anchors = rows[np.searchsorted(rows, np.arange(len(log)), side="right") - 1]
    turn = state.options.optimisation.metres_per_radian
    pairwise, nscan = widened_relations(state)
    tracked = without_single_jumps(
        np.concatenate(state.tracked), log.odometry, rows, state.options.single_scans
    )
    poses = between_keyframes(tracked, rows, state.poses, state.breaks, turn)
    graph = Graph(
        scans=log.numbers,
        stamps=list(log.stamps),
        poses=poses,
        odometry=log.odometry,
        anchors=anchors,
        pairwise=pairwise,
        nscan=nscan,
        others=state.other_relations,
        loops=state.loops + state.detector.refused(),
        path=None if log.path is None else bent_path(log.path, log.times, poses),
    )
    graph.marginals = marginal_covariances(graph)
    return graph
