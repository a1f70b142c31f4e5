"""The pose graph as a JSON file; pose-graph.schema.json beside this module describes it.

It has one record per line and keys in fixed order, so equal graphs give equal bytes and text tools work on
it.
"""

from __future__ import annotations

import io
import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator
from json.encoder import encode_basestring_ascii
from typing import Any, NoReturn

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.files.finite import check_finite
from nscan_cli.files.limits import TIME
from nscan_cli.files.provenance import provenance_of
from nscan_cli.graph.io.g2o_lines import LARGEST_KEY
from nscan_cli.graph.io.json_fields import (
    JsonRecord,
    MalformedError,
    pose_rows,
    rounded_upper_triangle,
    six_digits,
)
from nscan_cli.graph.io.path_records import path_of_records, path_records
from nscan_cli.graph.model import Graph, Loop
from nscan_cli.graph.relations.registry import relation_of, relation_record
from nscan_cli.logs.compression import compression_of
from nscan_cli.logs.formats import FORMS, foreign_kind
from nscan_cli.logs.scan_order import STAMP
from nscan_cli.poses import Array

GRAPH_FORMAT = "nscan-pose-graph"
VERSION = "1.0"
SCHEMA = "urn:nscan-cli:pose-graph:1.0"
GRAPH_UNITS = {"length": "m", "angle": "rad", "time": "s"}
POSES_AT_A_TIME = 1000
"""Poses that are converted to lists at a time; a larger value takes more memory."""
VERTEX_KEY = re.compile("0|[1-9][0-9]{0,19}")
"""A g2o vertex key: an integer of 64 bits as text, which every JSON reader keeps exact."""
NO_POSE = np.full(3, np.nan)
"""The odometry of a node that has none."""
RECORD_SEPARATOR = ",\n"
"""Between two records."""
_compact = json.JSONEncoder(separators=(",", ":"), allow_nan=False, check_circular=False).encode
JSON_REMEDY = "mend it, or write the graph again with nscan-cli slam"


def write_graph(graph: Graph) -> bytes:
    """The graph as a JSON document in UTF-8, with a final line feed.

    Poses have 9 decimals, matrices 6 significant digits. Raises NotFiniteError, and ValueError for a number
    in the provenance that is not finite.
    """
    check_finite("the poses of the graph", graph.poses, graph.known_odometry)
    check_finite("the path of the graph", None if graph.path is None else graph.path.poses)
    check_finite("the covariances of the graph", *graph.marginals.values())
    for relation in graph.relations:
        term = relation.term()
        check_finite(f"the relation of {relation.nodes}", term.local, term.hessian, relation.score)
    provenance = {**provenance_of([], {}), **graph.provenance}
    head: dict[str, Any] = {"$schema": SCHEMA, "format": GRAPH_FORMAT, "version": VERSION}
    head |= {"units": GRAPH_UNITS, "provenance": provenance}
    lists: dict[str, Iterable[str]] = {
        "nodes": _node_records(graph),
        "relations": (
            _compact({"id": number, **relation_record(relation)})
            for number, relation in enumerate(graph.relations)
        ),
        "loops": (_compact(_loop_record(loop)) for loop in graph.loops),
        "marginals": (
            _compact({"node": node, "covariance": rounded_upper_triangle(covariance)})
            for node, covariance in sorted(graph.marginals.items())
        ),
    }
    if graph.path is not None:
        lists["path"] = path_records(graph.path)
    # Record by record: all records as lists of numbers take many times the memory of the document.
    document = io.BytesIO()
    for key, value in head.items():
        document.write(f'{RECORD_SEPARATOR if document.tell() else "{"}"{key}":{_compact(value)}'.encode())
    for key, records in lists.items():
        document.write(f'{RECORD_SEPARATOR}"{key}":['.encode())
        separator = "\n"
        for record in records:
            document.write(f"{separator}{record}".encode())
            separator = RECORD_SEPARATOR
        document.write(b"]" if separator == "\n" else b"\n]")
    document.write(b"}\n")
    return document.getvalue()


def parse_graph(data: bytes, name: str) -> Graph:
    """The graph of a JSON document; errors name the file `name`.

    Raises InputDataError where it is not a graph or is inconsistent.
    """
    try:
        document = json.loads(data, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise _not_json(data, name, error) from error
    try:
        return _graph_of_document(JsonRecord(document, "document"))
    except MalformedError as error:
        raise InputDataError(name, str(error), JSON_REMEDY) from error


def _not_json(data: bytes, name: str, error: Exception) -> InputDataError:
    """The error of a file that is not JSON: where it is broken, or what it contains instead."""
    if data.strip() and data.lstrip()[:1] not in (b"{", b"["):
        return InputDataError(
            name, f"is {_kind_of_content(data)}", "give a graph in JSON, as nscan-cli slam writes it"
        )
    if isinstance(error, json.JSONDecodeError):
        problem = f"not JSON: {error.msg}" if data.strip() else "is empty"
        return InputDataError(name, problem, JSON_REMEDY, line=error.lineno)
    return InputDataError(name, f"not JSON: {error}", JSON_REMEDY)


def _kind_of_content(data: bytes) -> str:
    packing = compression_of(data)
    if packing is not None:
        return f"compressed by {packing.name}"
    log = next((form.name for form in FORMS if form.fits(data)), None)
    return f"a log ({log})" if log else foreign_kind(data).name


def _refuse_constant(constant: str) -> NoReturn:
    raise ValueError(f"it has a number {constant}")


def _node_records(graph: Graph) -> Iterator[str]:
    """The nodes in JSON, formatted directly: there is one per scan, and JSON objects would take longer."""
    poses = _pose_blocks(graph.poses)
    odometry = itertools.repeat(None, len(graph)) if graph.odometry is None else _pose_blocks(graph.odometry)
    scans, anchors = graph.scans.tolist(), graph.anchors.tolist()
    named: Iterable[str] = itertools.repeat("", len(graph))
    if graph.vertices is not None:
        named = (f'"vertex":"{key}",' for key in graph.vertices)
    each = zip(scans, named, graph.stamps, poses, odometry, anchors, strict=True)
    for node, (scan, vertex, stamp, (x, y, angle), sensed, anchor) in enumerate(each):
        pose = f'"pose":[{x!r},{y!r},{angle!r}]'
        if sensed is not None and not math.isnan(sensed[0]):
            pose += ',"odometry":[{!r},{!r},{!r}]'.format(*sensed)
        keyframe = '"keyframe":true' if anchor == node else f'"keyframe":false,"attached":{anchor}'
        stamped = f'{vertex}"stamp":{encode_basestring_ascii(stamp)}'
        yield f'{{"id":{node},"scan":{scan},{stamped},{pose},{keyframe}}}'


def _pose_blocks(poses: Array) -> Iterator[list[float]]:
    """The rows of poses (N, 3), in blocks: as lists they take many times the memory."""
    for first in range(0, len(poses), POSES_AT_A_TIME):
        yield from pose_rows(poses[first : first + POSES_AT_A_TIME])


def _loop_record(loop: Loop) -> dict[str, Any]:
    return {
        "nodes": list(loop.nodes),
        "accepted": loop.accepted,
        "reason": loop.reason,
        "score": six_digits(loop.score),
    }


def _graph_of_document(document: JsonRecord) -> Graph:
    if "format" not in document or document.get("format") != GRAPH_FORMAT:
        raise MalformedError("document", f"'format' is not {GRAPH_FORMAT!r}, so this is not a pose graph")
    if document.get("version") != VERSION:
        raise MalformedError("document", f"'version' is {document.get('version')!r}; {VERSION!r} can be read")
    if document.get("units") != GRAPH_UNITS:
        raise MalformedError("document", f"'units' is not {_compact(GRAPH_UNITS)}")
    provenance = _provenance(document)
    graph = _nodes(document)
    graph.provenance = provenance
    _relations(document, graph)
    keyframes = set(graph.keyframes.tolist())
    for record in document.records("loops"):
        nodes = _loop_nodes(record, keyframes)
        graph.loops.append(
            Loop(nodes, record.flag("accepted"), record.text("reason"), record.number("score"))
        )
    for record in document.records("marginals"):
        node = record.integer("node")
        _check_keyframes(record, (node,), keyframes)
        if node in graph.marginals:
            raise MalformedError(record.place, f"node {node} has a covariance already")
        graph.marginals[node] = record.information("covariance", 3)
    graph.path = path_of_records(document)
    return graph


def _provenance(document: JsonRecord) -> dict[str, Any]:
    provenance = JsonRecord(document.get("provenance"), "provenance")
    tool = JsonRecord(provenance.get("tool"), "provenance.tool")
    tool.text("name")
    tool.text("version")
    for source in provenance.records("inputs"):
        source.text("name")
        source.text("sha256")
        source.integer("bytes")
    JsonRecord(provenance.get("parameters"), "provenance.parameters")
    return provenance.value


def _nodes(document: JsonRecord) -> Graph:
    scans: list[int] = []
    stamps: list[str] = []
    poses: list[Array] = []
    odometry: list[Array] = []
    vertices: list[int] = []
    anchors: list[int] = []
    for node, record in enumerate(document.records("nodes")):
        _check_id(record, node)
        scans.append(record.integer("scan"))
        if node > 0 and scans[-1] <= scans[-2]:
            raise MalformedError(record.place, "'scan' is not greater than that of the node before")
        stamps.append(_node_stamp(record))
        poses.append(record.pose("pose"))
        odometry.append(record.pose("odometry") if "odometry" in record else NO_POSE)
        if "vertex" in record:
            vertices.append(_node_vertex(record))
        anchors.append(_node_anchor(record, node))
    if not poses:
        raise MalformedError("nodes", "there are none")
    if vertices and len(set(vertices)) != len(poses):
        raise MalformedError("nodes", "'vertex' is not unique to each of them")
    for node, anchor in enumerate(anchors):
        if anchor >= len(anchors) or anchors[anchor] != anchor:
            raise MalformedError(f"nodes[{node}]", f"'attached' is {anchor}, which is not a keyframe")
    return Graph(
        scans=np.array(scans, dtype=np.int64),
        stamps=stamps,
        poses=np.array(poses),
        odometry=None if all(sensed is NO_POSE for sensed in odometry) else np.array(odometry),
        anchors=np.array(anchors, dtype=np.int64),
        vertices=vertices or None,
    )


def _node_vertex(record: JsonRecord) -> int:
    key = record.text("vertex")
    if not VERTEX_KEY.fullmatch(key) or int(key) > LARGEST_KEY:
        raise record.wrong("vertex", "a number of 64 bits, as text")
    return int(key)


def _node_stamp(record: JsonRecord) -> str:
    stamp = record.text("stamp")
    if not STAMP.fullmatch(stamp) or abs(float(stamp)) > TIME.value:
        raise record.wrong("stamp", f"a time in seconds, as text, up to {TIME.text()}")
    return stamp


def _node_anchor(record: JsonRecord, node: int) -> int:
    if not record.flag("keyframe"):
        anchor = record.integer("attached")
        if anchor == node:
            raise MalformedError(record.place, "'attached' is the node itself, which is not a keyframe")
        return anchor
    if "attached" in record:
        raise MalformedError(record.place, "a keyframe cannot be 'attached'")
    return node


def _relations(document: JsonRecord, graph: Graph) -> None:
    keyframes = set(graph.keyframes.tolist())
    for number, record in enumerate(document.records("relations")):
        _check_id(record, number)
        relation = relation_of(record)
        _check_keyframes(record, relation.nodes, keyframes)
        graph.add(relation)


def _check_id(record: JsonRecord, number: int) -> None:
    if (found := record.integer("id")) != number:
        raise MalformedError(record.place, f"'id' is {found}, but ids count up from 0, here {number}")


def _loop_nodes(record: JsonRecord, keyframes: set[int]) -> tuple[int, int]:
    nodes = record.integers("nodes")
    if len(nodes) != 2:
        raise record.wrong("nodes", "a pair of nodes")
    _check_keyframes(record, nodes, keyframes)
    return nodes[0], nodes[1]


def _check_keyframes(record: JsonRecord, nodes: tuple[int, ...], keyframes: set[int]) -> None:
    for node in nodes:
        if node not in keyframes:
            raise MalformedError(record.place, f"node {node} is not a keyframe of this graph")
