"""The relation of two keyframes: a measured relative pose (paper, IV, eqs. (16) and (17))."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from nscan_cli.graph.io.json_fields import JsonRecord, pose_rows, rounded_upper_triangle
from nscan_cli.graph.relations.base import Term
from nscan_cli.poses import Array


@dataclass(frozen=True)
class Pairwise:
    """A measurement of x̂_b ⊖ x̂_a, eqs. (16) and (17), of the nodes (a, b)."""

    kind: ClassVar[str] = "pairwise"
    nodes: tuple[int, int]
    measurement: Array
    """(3,) pose of nodes[1] in the frame of nodes[0]."""
    information: Array
    """(3, 3) C⁻¹, the inverse covariance of the measurement."""
    origin: str
    """Where it comes from: odometry, track or loop."""
    score: float = 0.0
    """Overlap of the scans, 0 to 1; 0 where it is not known."""

    def term(self) -> Term:
        """ΔᵗC⁻¹Δ with Δ = (b ⊖ a) − p_ab, eqs. (16) and (17).

        This is (23) for two poses with c = a at the origin of the local frame, where (19) to (22) reduce to
        (16).
        """
        return self._term

    @cached_property
    def _term(self) -> Term:
        # Cached: a growing graph builds its energy anew for each new keyframe.
        local, hessian = np.zeros((2, 3)), np.zeros((6, 6))
        local[1], hessian[3:, 3:] = self.measurement, self.information
        return Term(local, hessian, 0)

    def content(self) -> dict[str, Any]:
        """The measurement and its information."""
        return {
            "measurement": pose_rows(self.measurement[None])[0],
            "information": rounded_upper_triangle(self.information),
        }

    @classmethod
    def from_content(cls, record: JsonRecord, nodes: tuple[int, ...], origin: str, score: float) -> Self:
        """The relation of such a JSON object. Raises MalformedError."""
        if len(nodes) != 2:
            raise record.wrong("nodes", "a pair of nodes")
        a, b = nodes
        return cls((a, b), record.pose("measurement"), record.information("information", 3), origin, score)
