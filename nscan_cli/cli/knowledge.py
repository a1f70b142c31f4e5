"""What `nscan` knows before it matches: poses to start from, and priors, from the log or from files."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.evaluation.association import TOLERANCE, nearest
from nscan_cli.graph.json_file import parse_graph
from nscan_cli.graph.model import Graph
from nscan_cli.graph.tum import Trajectory, parse_tum
from nscan_cli.inputs import base_name, label, read_bytes
from nscan_cli.logs.scan import LaserLog, Source
from nscan_cli.matching.joint_energy import Priors, no_priors
from nscan_cli.matching.nscan import PriorsAmong
from nscan_cli.matching.priors import MotionModel, odometry_prior
from nscan_cli.poses import Array

OTHER_LOG = "give the graph that was made from this log"


@dataclass(frozen=True)
class Knowledge:
    """A graph or a trajectory, and the file that it comes from."""

    content: Graph | Trajectory
    source: Source
    name: str
    """The file as messages call it."""


def read_knowledge(path: str, log: LaserLog) -> Knowledge:
    """The graph or TUM trajectory at `path`, told apart by content.

    Raises InputMissingError when it cannot be read, InputDataError when it is neither, or the graph of
    another log.
    """
    data, name = read_bytes(path), label(path)
    source = Source(base_name(path), hashlib.sha256(data).hexdigest(), len(data))
    if not data.lstrip().startswith(b"{"):
        return Knowledge(parse_tum(data, name), source, name)
    graph = parse_graph(data, name)
    logs = graph.provenance.get("inputs") or [{}]
    if logs[0].get("sha256", log.source.sha256) != log.source.sha256:
        raise InputDataError(name, f"is not a graph of {log.source.name}: the SHA-256 differs", OTHER_LOG)
    return Knowledge(graph, source, name)


def poses_of(knowledge: Knowledge, log: LaserLog, rows: Sequence[int]) -> Array:
    """The poses (n, 3) of the scans in `rows`. Raises InputDataError naming the first without one."""
    content = knowledge.content
    if isinstance(content, Graph):
        numbers = log.numbers[rows]
        found = np.minimum(np.searchsorted(content.scans, numbers), len(content) - 1)
        missing = content.scans[found] != numbers
    else:
        times = log.times[rows]
        found = nearest(content.times, times)
        missing = np.abs(content.times[found] - times) > TOLERANCE
    if missing.any():
        number = log.numbers[rows[int(np.argmax(missing))]]
        raise InputDataError(knowledge.name, f"has no pose of scan {number}", "leave the scan out")
    return content.poses[found]


def no_knowledge(_kept: Sequence[int]) -> Priors:
    """No priors, whichever the scans are."""
    return no_priors()


def odometry_priors(odometry: Array, numbers: Sequence[int], model: MotionModel) -> PriorsAmong:
    """The odometry (n, 3) of the scans `numbers` as priors from each scan to the next in time."""

    def among(kept: Sequence[int]) -> Priors:
        order = sorted(range(len(kept)), key=lambda at: numbers[kept[at]])
        pairs = list(itertools.pairwise(order))
        priors = [odometry_prior(odometry[kept[a]], odometry[kept[b]], model) for a, b in pairs]
        return _priors(pairs, [prior.mean for prior in priors], [prior.information for prior in priors])

    return among


def graph_priors(graph: Graph, numbers: Sequence[int]) -> PriorsAmong:
    """The graph's pairwise relations among the scans `numbers` as priors (paper, V, step 3)."""

    def among(kept: Sequence[int]) -> Priors:
        places = {numbers[scan]: at for at, scan in enumerate(kept)}
        found = []
        for relation in graph.pairwise:
            a, b = (places.get(int(graph.scans[node])) for node in relation.nodes)
            if a is not None and b is not None:
                found.append(((a, b), relation.measurement, relation.information))
        return _priors([row[0] for row in found], [row[1] for row in found], [row[2] for row in found])

    return among


def _priors(pairs: list[tuple[int, int]], means: list[Array], information: list[Array]) -> Priors:
    if not pairs:
        return no_priors()
    return Priors(np.array(pairs, dtype=np.int64), np.array(means), np.array(information))
