"""The pose graph: a pose for every scan, and the relations between keyframes (paper, IV)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nscan_cli.graph.relations.base import Relation
from nscan_cli.graph.relations.nscan import NScan
from nscan_cli.graph.relations.pairwise import Pairwise
from nscan_cli.graph.relations.registry import is_joint, is_pairwise
from nscan_cli.poses import Array, Indices, are_known, compose, relative, rotated_information

if TYPE_CHECKING:
    from nscan_cli.logs.robot_path import RobotPath

__all__ = ["Graph", "Loop", "NScan", "Pairwise"]


@dataclass(frozen=True)
class Loop:
    """A candidate loop between two keyframes, and why it was accepted or refused."""

    nodes: tuple[int, int]
    """Ids of the keyframes."""
    accepted: bool
    reason: str
    """Why it was refused, or what was left out of it; "" if nothing was."""
    score: float
    """Overlap of the match, or score of the best place that was found, 0 to 1."""


@dataclass
class Graph:
    """Nodes as columns (N scans; a node's id is its row), relations as lists.

    A keyframe is its own anchor. Every other node moves rigidly with the keyframe that `anchors` names.
    """

    scans: Indices
    """(N,) scan numbers."""
    stamps: list[str]
    """N times in seconds, as the log writes them."""
    poses: Array
    """(N, 3) global poses of the robot."""
    odometry: Array | None
    """(N, 3) poses by odometry, nan where it is missing; None if the log has no odometry."""
    anchors: Indices
    """(N,) id of the keyframe that the node is attached to."""
    pairwise: list[Pairwise] = field(default_factory=list)
    nscan: list[NScan] = field(default_factory=list)
    others: list[Relation] = field(default_factory=list)
    """Relations of further types."""
    loops: list[Loop] = field(default_factory=list)
    marginals: dict[int, Array] = field(default_factory=dict)
    """Keyframe id → (3, 3) marginal covariance of its global pose, the first keyframe held fixed."""
    path: RobotPath | None = None
    """The path of the robot between the poses, if the laser turns: it is known more finely than by one pose a
    scan. Where the poses have moved since, the path between them goes along. None where it is not known."""
    vertices: list[int] | None = None
    """(N,) the vertex keys in the g2o file, up to 64 bits; None where they are the scan numbers."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """The JSON field: tool, inputs (name, sha256, bytes), parameters."""

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def relations(self) -> list[Relation]:
        """All relations: pairwise, nScan, others."""
        return [*self.pairwise, *self.nscan, *self.others]

    def add(self, relation: Relation) -> None:
        """Append a relation to the list of its type."""
        if is_pairwise(relation):
            self.pairwise.append(relation)
        elif is_joint(relation):
            self.nscan.append(relation)
        else:
            self.others.append(relation)

    @property
    def keyframes(self) -> Indices:
        """The ids (K,) of the keyframes, increasing."""
        return np.flatnonzero(self.anchors == np.arange(len(self))).astype(np.int64)

    @property
    def known_odometry(self) -> Array | None:
        """(n, 3) the odometry of the nodes that have it, or None."""
        return None if self.odometry is None else self.odometry[are_known(self.odometry)]

    @property
    def times(self) -> Array:
        """(N,) the stamps in seconds."""
        return np.array([float(stamp) for stamp in self.stamps])

    def move_keyframes(self, keyframes: Indices, poses: Array) -> None:
        """Set the poses (K, 3) of keyframes (K,), and move the nodes attached to them rigidly along."""
        moved = self.poses.copy()
        moved[keyframes] = poses
        attached = np.flatnonzero(self.anchors != np.arange(len(self)))
        anchors = self.anchors[attached]
        moved[attached] = compose(moved[anchors], relative(self.poses[attached], self.poses[anchors]))
        self.poses = moved


def turned_graph(graph: Graph, turn: float) -> Graph:
    """The graph turned by an angle (rad) about the origin. Its relations are relative and stay."""
    frame = np.array([0.0, 0.0, turn])
    return replace(
        graph,
        poses=compose(np.broadcast_to(frame, graph.poses.shape), graph.poses),
        marginals={node: rotated_information(frame, cov) for node, cov in graph.marginals.items()},
    )
