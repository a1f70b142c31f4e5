"""The interface of relation types: a term of the graph's energy, and the fields that files keep."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple, Protocol, Self

from nscan_cli.graph.io.json_fields import JsonRecord
from nscan_cli.poses import Array


class Term(NamedTuple):
    """fᵗHf, eq. (23), where f is the global poses of n nodes, mapped by pose c, minus the local poses."""

    local: Array
    """(n, 3), in any frame."""
    hessian: Array
    """(3n, 3n) H, an inverse covariance, positive semi-definite; 0 in directions that are not measured. The
    rows and columns of pose c are ignored."""
    fixed: int
    """Index among the n of pose c, which carries the mapping from global to local coordinates."""
    at: Callable[[Array], Term] | None = None
    """The term at global poses (n, 3), for an error e that is not linear in f; None for a constant term. With
    the information W of e and J = ∂e/∂f there, H is JᵗWJ, and the local poses give J f = e. Pose c stays the
    same. H is 0 where e has no derivative: the chordal start puts all keyframes in one place. The exact
    Hessian leaves out the second derivatives of e."""


class Relation(Protocol):
    """A relation of any type between keyframes; its classes are frozen."""

    kind: ClassVar[str]
    """The type's name in files."""

    @property
    def nodes(self) -> tuple[int, ...]:
        """Ids of two or more keyframes."""

    @property
    def origin(self) -> str:
        """Its source, one of ORIGINS. A loop is removed when it contradicts the other relations."""

    @property
    def score(self) -> float:
        """Overlap of the scans that were matched, 0 to 1; 0 where it is not known."""

    def term(self) -> Term:
        """Its term of the energy, with the nodes in their order."""

    def content(self) -> dict[str, Any]:
        """The fields of its JSON object that are special to this type."""

    @classmethod
    def from_content(cls, record: JsonRecord, nodes: tuple[int, ...], origin: str, score: float) -> Self:
        """The relation of such a JSON object. Raises MalformedError."""
