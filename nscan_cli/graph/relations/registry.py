"""The registered relation types, and their JSON objects."""

from __future__ import annotations

from typing import Any, TypeGuard

from nscan_cli.graph.io.json_fields import JsonRecord, six_digits
from nscan_cli.graph.relations.base import Relation
from nscan_cli.graph.relations.nscan import NScan
from nscan_cli.graph.relations.pairwise import Pairwise

RELATION_TYPES: list[type[Relation]] = [
    Pairwise,
    NScan,
]
"""A new relation type takes one module and one line here."""

ORIGINS = ("odometry", "track", "nscan", "loop")
"""Where a relation can come from: odometry, tracking, a joint match, or a match that closes a loop."""


def is_pairwise(relation: Relation) -> TypeGuard[Pairwise]:
    """Whether it is a measured relative pose of two keyframes."""
    return isinstance(relation, Pairwise)


def is_joint(relation: Relation) -> TypeGuard[NScan]:
    """Whether it comes from a joint match, about pose c."""
    return isinstance(relation, NScan)


def centre_of(relation: Relation) -> int:
    """The keyframe about which slam made the match of the relation."""
    return relation.nodes[relation.fixed if is_joint(relation) else 1]


def relation_record(relation: Relation, key: str = "nodes") -> dict[str, Any]:
    """The JSON object of a relation; `key` names its members: "nodes" or "scans"."""
    return {
        "type": relation.kind,
        key: list(relation.nodes),
        **relation.content(),
        "origin": relation.origin,
        "score": six_digits(relation.score),
    }


def relation_of(record: JsonRecord, key: str = "nodes") -> Relation:
    """The relation of such a JSON object. Raises MalformedError where its fields are inconsistent."""
    types = {each.kind: each for each in RELATION_TYPES}
    found = types[record.text("type", tuple(types))]
    origin, score = record.text("origin", ORIGINS), record.number("score")
    return found.from_content(record, record.integers(key), origin, score)
