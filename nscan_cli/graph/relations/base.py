"""What every type of relation gives: a term of the graph's energy, and what a file keeps of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple, Protocol, Self

from nscan_cli.graph.io.json_fields import JsonRecord
from nscan_cli.poses import Array


class Term(NamedTuple):
    """fᵗHf of n local poses, eq. (23): f are the relation's global poses, mapped by pose c, minus these."""

    local: Array
    """(n, 3), in any frame."""
    hessian: Array
    """(3n, 3n) H, positive semi-definite, an inverse covariance; 0 where the relation says nothing. What it
    has in the rows and columns of pose c does not count."""
    fixed: int
    """Index among the n of pose c, which carries the mapping from global to local coordinates."""
    at: Callable[[Array], Term] | None = None
    """What it is at global poses (n, 3), for an error e that is not linear in f: with e's information W and
    J = ∂e/∂f there, H is JᵗWJ, and the local poses are such that J f is e. Pose c is the same, and at poses
    where e has no derivative H is 0: a graph is also begun with all keyframes in one place. The second
    derivatives of e are left out of the exact Hessian. None: the term is the same everywhere."""


class Relation(Protocol):
    """A relation between keyframes, of any type; frozen."""

    kind: ClassVar[str]
    """The type's name in files."""

    @property
    def nodes(self) -> tuple[int, ...]:
        """Ids of two keyframes or more."""

    @property
    def origin(self) -> str:
        """Where it comes from, one of ORIGINS. A loop is doubted: it goes when it contradicts the others."""

    @property
    def score(self) -> float:
        """How well what it was made from agrees, 0 to 1; 0 where nobody knows."""

    def term(self) -> Term:
        """What it gives to the energy, of its nodes in their order."""

    def content(self) -> dict[str, Any]:
        """The fields of its JSON object that other types do not have."""

    @classmethod
    def from_content(cls, record: JsonRecord, nodes: tuple[int, ...], origin: str, score: float) -> Self:
        """The relation of such an object again. Raises MalformedError."""
