"""Initial poses and priors of `nscan`, from the log or from files."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.cli.nscan import INITIAL_WORDS, PRIOR_WORDS
from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.evaluation.options import EvaluationOptions
from nscan_cli.files.encoding import without_byte_order_mark
from nscan_cli.files.inputs import base_name, label, read_bytes
from nscan_cli.files.limits import GRAPH
from nscan_cli.files.provenance import Source, is_made_from
from nscan_cli.graph.io.json_graph import parse_graph
from nscan_cli.graph.io.tum import Trajectory, parse_tum
from nscan_cli.graph.model import Graph, Pairwise
from nscan_cli.graph.relative_covariance import RelativePoses
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.scan_order import nearest_in_time
from nscan_cli.matching.joint.joint_energy import Priors
from nscan_cli.matching.joint.nscan_match import PriorsAmong
from nscan_cli.matching.joint.odometry_priors import odometry_priors, priors_of
from nscan_cli.matching.motion_model import MotionModel
from nscan_cli.poses import Array, relative

LOG_REMEDY = "give the graph that was made from this log"


@dataclass(frozen=True)
class PoseFile:
    """A graph or a trajectory, and its file."""

    content: Graph | Trajectory
    source: Source
    name: str
    """The name of the file in messages."""


def read_pose_file(path: str, log: LaserLog) -> PoseFile:
    """Read the graph or TUM trajectory at `path`; its content decides which.

    Raises InputMissingError if it cannot be read, InputDataError if it is neither or the graph of another
    log.
    """
    data, name = read_bytes(path, GRAPH), label(path)
    source = Source(base_name(path), hashlib.sha256(data).hexdigest(), len(data))
    data = without_byte_order_mark(data, name)
    if not data.lstrip().startswith(b"{"):
        return PoseFile(parse_tum(data, name), source, name)
    graph = parse_graph(data, name)
    inputs = graph.provenance.get("inputs")
    if inputs and not is_made_from(inputs, log.source):
        raise InputDataError(name, f"is not a graph of {log.source.name}: the SHA-256 differs", LOG_REMEDY)
    return PoseFile(graph, source, name)


def initial_and_priors(
    log: LaserLog, numbers: tuple[int, ...], initial: str, prior: str, model: MotionModel
) -> tuple[Array, PriorsAmong, list[Source]]:
    """The initial poses (n, 3), the priors, and the files that they come from."""
    rows = [log.row(number) for number in numbers]
    odometry = None if log.odometry is None else log.odometry[rows]
    paths = [path for path, words in ((initial, INITIAL_WORDS), (prior, PRIOR_WORDS)) if path not in words]
    files = {path: read_pose_file(path, log) for path in dict.fromkeys(paths)}
    start = np.zeros((len(rows), 3))
    if initial not in INITIAL_WORDS:
        start = initial_poses(files[initial], log, rows)
    elif initial == "odometry" and odometry is not None:
        start = relative(odometry, odometry[0])
    if prior not in PRIOR_WORDS:
        graph = files[prior].content
        if not isinstance(graph, Graph):
            raise WrongUsageError(f"--prior {prior}: is a trajectory, which has no relations; give a graph")
        priors = graph_priors(graph, numbers)
    else:
        priors = odometry_priors(odometry if prior == "odometry" else None, numbers, model)
    return start, priors, [knowledge.source for knowledge in files.values()]


def initial_poses(knowledge: PoseFile, log: LaserLog, rows: Sequence[int]) -> Array:
    """The poses (n, 3) of the scans in `rows`. Raises InputDataError if one has no pose."""
    content = knowledge.content
    if isinstance(content, Graph):
        numbers = log.numbers[rows]
        found = np.minimum(np.searchsorted(content.scans, numbers), len(content) - 1)
        missing = content.scans[found] != numbers
    else:
        times = log.times[rows]
        found = nearest_in_time(content.times, times)
        missing = np.abs(content.times[found] - times) > EvaluationOptions.tolerance
    if missing.any():
        number = log.numbers[rows[int(np.argmax(missing))]]
        raise InputDataError(knowledge.name, f"has no pose of scan {number}", "leave the scan out")
    return content.poses[found]


def graph_priors(graph: Graph, numbers: Sequence[int]) -> PriorsAmong:
    """Priors for the scans `numbers` from a graph (paper, V, step 3).

    These are its pairwise relations among the scans. Groups of scans that only other relations connect get
    the marginal relative pose of two scans that are next in time.
    """
    nodes = {int(scan): node for node, scan in enumerate(graph.scans)}
    between = RelativePoses(graph, [nodes[number] for number in numbers if number in nodes])

    def among(kept: Sequence[int]) -> Priors:
        places = {nodes[numbers[scan]]: at for at, scan in enumerate(kept) if numbers[scan] in nodes}
        found = [relation for relation in graph.pairwise if all(node in places for node in relation.nodes)]
        found += _connecting_relations(between, sorted(places), [relation.nodes for relation in found])
        return priors_of(
            [(places[a], places[b]) for a, b in (relation.nodes for relation in found)],
            [relation.measurement for relation in found],
            [relation.information for relation in found],
        )

    return among


def _connecting_relations(
    between: RelativePoses, nodes: list[int], joined: list[tuple[int, int]]
) -> list[Pairwise]:
    """Marginal relations between the groups of nodes that the pairs in `joined` leave unconnected."""
    group = {node: node for node in nodes}

    def join(a: int, b: int) -> None:
        gone = group[b]
        group.update({node: group[a] for node in nodes if group[node] == gone})

    for a, b in joined:
        join(a, b)
    bridges = []
    for at, node in enumerate(nodes):
        for earlier in reversed(nodes[:at]):
            if group[earlier] == group[node]:
                break
            relation = between.relation(earlier, node)
            if relation is not None:
                bridges.append(relation)
                join(earlier, node)
                break
    return bridges
