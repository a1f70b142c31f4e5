"""The path of a graph in its JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.model import Graph
from nscan_cli.logs.robot_path import robot_path
from tests.graph.schema import validate
from tests.graph.small_graph import small_graph


def graph_with_path() -> Graph:
    graph = small_graph()
    times = np.array([976052896.784509, 976052897.1, 976052897.9000001, 976052898.5])
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.25, -3.0], [1.5, 1 / 3, 7.0], [2.0, 0.5, 0.1]])
    graph.path = robot_path(times, poses)
    return graph


def test_a_path_comes_back_and_has_the_same_bytes():
    data = write_graph(graph_with_path())
    validate(json.loads(data))
    assert json.loads(data)["path"][2] == [976052897.9000001, 1.5, 0.333333333, 0.716814693]
    again, path = parse_graph(data, "graph.json"), graph_with_path().path
    assert again.path is not None
    assert path is not None
    np.testing.assert_array_equal(again.path.times, path.times)
    np.testing.assert_allclose(again.path.poses[:, :2], path.poses[:, :2], atol=1e-9)
    assert write_graph(again) == data


def test_a_graph_without_a_path_has_no_such_key():
    assert "path" not in json.loads(write_graph(small_graph()))
    assert parse_graph(write_graph(small_graph()), "graph.json").path is None


@pytest.mark.parametrize(("change", "said"), [
    (lambda path: path.clear(), "'path' is not a list of at least two"),
    (lambda path: path[1].pop(), r"path\[1\]: is not a time"),
    (lambda path: path[2].__setitem__(3, None), r"path\[2\]: is not a time"),
    (lambda path: path[2].__setitem__(1, 1e10), r"path\[2\]: is not a time"),
    (lambda path: path[3].__setitem__(0, 976052897.0), r"path\[3\]: is not later"),
])  # fmt: skip
def test_a_path_that_is_none_is_refused_with_its_place(change, said):
    document = json.loads(write_graph(graph_with_path()))
    change(document["path"])
    with pytest.raises(InputDataError, match=said):
        parse_graph(json.dumps(document).encode(), "graph.json")
