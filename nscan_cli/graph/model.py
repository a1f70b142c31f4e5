"""The pose graph: a pose for every scan, and the relations between keyframes (paper, IV)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array, compose, relative


@dataclass(frozen=True)
class Pairwise:
    """A pairwise relation, eqs. (16) and (17): x̂_b ⊖ x̂_a was measured, where (a, b) = nodes."""

    nodes: tuple[int, int]
    measurement: Array
    """(3,) pose of nodes[1] in the frame of nodes[0]."""
    information: Array
    """(3, 3) C⁻¹ of the components of the measurement."""
    origin: str
    """odometry, track or loop."""
    score: float = 0.0


@dataclass(frozen=True)
class NScan:
    """An nScan relation, eqs. (19) to (23): the local poses of n scans matched jointly."""

    nodes: tuple[int, ...]
    poses: Array
    """(n, 3) local poses, in a frame of their own."""
    hessian: Array
    """(3n, 3n) H, at the local poses, variables (x, y, φ) scan by scan; its null space is the gauge."""
    fixed: int
    """Index into nodes of pose c, which carries the mapping from global to local coordinates."""
    origin: str
    score: float = 0.0


@dataclass(frozen=True)
class Loop:
    """A loop that was tried between two keyframes, and why it was accepted or refused."""

    nodes: tuple[int, int]
    accepted: bool
    reason: str
    score: float


@dataclass
class Graph:
    """Nodes as columns (N scans; a node's id is its row), relations as lists.

    A keyframe is its own anchor; any other node moves with the keyframe that `anchors` names.
    """

    scans: NDArray[np.int64]
    """(N,) scan numbers."""
    stamps: list[str]
    poses: Array
    """(N, 3) global poses of the robot."""
    odometry: Array | None
    """(N, 3) or None."""
    anchors: NDArray[np.int64]
    """(N,) id of the keyframe that the node is attached to."""
    pairwise: list[Pairwise] = field(default_factory=list)
    nscan: list[NScan] = field(default_factory=list)
    loops: list[Loop] = field(default_factory=list)
    marginals: dict[int, Array] = field(default_factory=dict)
    """Keyframe id → (3, 3) marginal covariance of its global pose, the first keyframe held fixed."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """As in the JSON: tool, inputs (name, sha256, bytes), parameters."""

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def keyframes(self) -> NDArray[np.int64]:
        """The ids (K,) of the keyframes, increasing."""
        return np.flatnonzero(self.anchors == np.arange(len(self))).astype(np.int64)

    @property
    def times(self) -> Array:
        """(N,) the stamps in seconds."""
        return np.array([float(stamp) for stamp in self.stamps])

    def move_keyframes(self, keyframes: NDArray[np.int64], poses: Array) -> None:
        """Give keyframes (K,) new poses (K, 3); every attached node moves along rigidly."""
        moved = self.poses.copy()
        moved[keyframes] = poses
        attached = np.flatnonzero(self.anchors != np.arange(len(self)))
        anchors = self.anchors[attached]
        moved[attached] = compose(moved[anchors], relative(self.poses[attached], self.poses[anchors]))
        self.poses = moved
