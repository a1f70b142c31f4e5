"""The relation of n keyframes whose scans were matched jointly (paper, IV, eqs. (18) to (23)).

The relation is data. `nscan_term` in graph/optimise/relation_terms.py computes eqs. (18) to (25) themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

from nscan_cli.graph.io.json_fields import JsonRecord, MalformedError, pose_rows, rounded_upper_triangle
from nscan_cli.graph.relations.base import Term
from nscan_cli.poses import Array


@dataclass(frozen=True)
class NScan:
    """An nScan relation, eqs. (19) to (23): the local poses of n scans matched jointly."""

    kind: ClassVar[str] = "nscan"
    nodes: tuple[int, ...]
    poses: Array
    """(n, 3) local poses, in the frame of the relation."""
    hessian: Array
    """(3n, 3n) H at the local poses, with variables (x, y, φ) scan by scan; its null space is the gauge."""
    fixed: int
    """Index into nodes of pose c, which carries the mapping from global to local coordinates."""
    origin: str
    """Where it comes from: nscan, or loop."""
    score: float = 0.0
    """Overlap of the scans, 0 to 1; 0 where it is not known."""

    def term(self) -> Term:
        """What fᵗHf, eq. (23), is made of; `nscan_term` in graph/optimise/relation_terms.py computes it."""
        return Term(self.poses, self.hessian, self.fixed)

    def content(self) -> dict[str, Any]:
        """The local poses, H, and the node of pose c."""
        return {
            "poses": pose_rows(self.poses),
            "hessian": rounded_upper_triangle(self.hessian),
            "fixed": self.nodes[self.fixed],
        }

    @classmethod
    def from_content(cls, record: JsonRecord, nodes: tuple[int, ...], origin: str, score: float) -> Self:
        """The relation of such a JSON object. Raises MalformedError."""
        fixed = record.integer("fixed")
        if fixed not in nodes:
            raise MalformedError(record.place, f"'fixed' is {fixed}, which is not one of its nodes")
        poses, c = record.poses("poses", len(nodes)), nodes.index(fixed)
        hessian = record.information("hessian", 3 * len(nodes), c)
        return cls(nodes, poses, hessian, c, origin, score)
