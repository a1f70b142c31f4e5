"""What the damaged bytes are given to: every reader, and what has to hold of its answer."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np

from nscan_cli.cli.info import facts_of, facts_table
from nscan_cli.cli.main import cli
from nscan_cli.errors import NscanError
from nscan_cli.evaluation.load_trajectory import load_trajectory
from nscan_cli.evaluation.reference_relations import read_relations
from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.nightly.manifest import read_manifest
from tests.graph.small_graph import read_tum

PROMISED = (2, 3, 65, 66, 73)
LONGEST = 10_000
"""Characters of a message."""


class UnsoundError(Exception):
    """An answer that breaks a promise."""


def log(path: str, chance: random.Random) -> None:
    """Any log, with options by chance; `info` has to be able to print it."""
    options = ReadingOptions(
        strict=chance.random() < 0.1,
        salvage=chance.random() < 0.4,
        allow_corrected=chance.random() < 0.7,
        odometry=chance.random() < 0.9,
        every=chance.choice([1, 1, 1, 3]),
        start=chance.choice([None, None, 0.5]),
        flip=chance.random() < 0.1,
    )
    facts = facts_of(read_log(path, options), options)
    json.dumps(facts, allow_nan=False)
    facts_table(facts)


def json_graph(path: str, chance: random.Random) -> None:
    """A graph that is read can be written, and reads back as the same."""
    graph = load_graph(path)
    written = write_graph(graph)
    if not _same(write_graph(parse_graph(written, "again")), written):
        raise UnsoundError("a graph that was read and written reads back as another")
    write_g2o(graph)
    write_tum(graph.stamps, graph.poses)


def _same(one: bytes, other: bytes) -> bool:
    """Whether two graphs are: byte for byte, but for matrices that rounding made negative, and are mended."""
    if one == other:
        return True
    documents, matrices = [json.loads(data) for data in (one, other)], []
    for document in documents:
        records = [*document["relations"], *document["marginals"]]
        keys = ("information", "hessian", "covariance")
        matrices.append([np.array(record.pop(key)) for record in records for key in keys if key in record])
    return documents[0] == documents[1] and all(
        np.abs(a - b).max() <= 1e-4 * np.abs(a).max() for a, b in zip(*matrices, strict=True)
    )


def g2o(path: str, chance: random.Random) -> None:
    """As for JSON."""
    graph = load_graph(path)
    write_graph(graph)
    Path(path).write_bytes(write_g2o(graph))
    load_graph(path)


def tum(path: str, chance: random.Random) -> None:
    """A trajectory that is read can be written."""
    trajectory = read_tum(path)
    write_tum(trajectory.stamps, trajectory.poses)


def relations(path: str, chance: random.Random) -> None:
    """Reference relations."""
    read_relations(path)


def result(path: str, chance: random.Random) -> None:
    """Anything that `evaluate` may be given, told apart by its content."""
    load_trajectory(path)


def config(path: str, chance: random.Random) -> None:
    """A TOML of options, for a command by chance."""
    name = chance.choice(["info", "slam", "render"])
    arguments = {"info": ["x"], "slam": ["x"], "render": ["x", "-o", "-"]}[name]
    try:
        cli.main([name, *arguments, "--config", path, "--dump-config"], "nscan-cli", standalone_mode=False)
    except click.ClickException as error:
        if error.exit_code not in PROMISED:
            raise


def manifest(path: str, chance: random.Random) -> None:
    """A manifest of the nightly."""
    read_manifest(path, None)


READERS: dict[str, list[Callable[[str, random.Random], None]]] = {
    "json graph": [json_graph, json_graph, result],
    "g2o": [g2o],
    "tum": [tum, result],
    "relations": [relations],
    "config": [config],
    "manifest": [manifest],
}
LOG_READERS = [log, log, log, result]


def outcome(form: str, path: str, chance: random.Random) -> str:
    """What a reader says to a file: "read", or the error that a user sees.

    Raises whatever is none of these: a fault.
    """
    try:
        chance.choice(READERS.get(form, LOG_READERS))(path, chance)
    except NscanError as error:
        if error.exit_code not in PROMISED or len(str(error)) > LONGEST:
            raise UnsoundError(f"exit code {error.exit_code}: {str(error)[:200]}") from error
        return f"{type(error).__name__} ({error.exit_code})"
    return "read"
