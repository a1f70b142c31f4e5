"""Loading of a saved graph; the format is detected from the content."""

from __future__ import annotations

from nscan_cli.files.encoding import without_byte_order_mark
from nscan_cli.files.inputs import label, read_bytes
from nscan_cli.files.limits import GRAPH
from nscan_cli.graph.io.g2o import loss_messages, parse_g2o
from nscan_cli.graph.io.json_graph import parse_graph
from nscan_cli.graph.model import Graph


def load_graph(path: str, notices: list[str] | None = None) -> Graph:
    """The graph in a JSON or a g2o file; "-" reads standard input.

    Notices of skipped lines are added to `notices`. Raises InputMissingError where the file cannot be read,
    and InputDataError where it is not a graph.
    """
    return graph_from(read_bytes(path, GRAPH), path, notices)


def graph_from(data: bytes, path: str, notices: list[str] | None = None) -> Graph:
    """The graph in the bytes that `path` has, as load_graph reads it."""
    text = without_byte_order_mark(data, label(path))
    if text.lstrip()[:1] == b"{":
        return parse_graph(text, label(path))
    graph = parse_g2o(data, path)
    if notices is not None:
        notices += [f"{label(path)}: {lost}" for lost in loss_messages(graph.provenance["skipped"])]
    return graph
