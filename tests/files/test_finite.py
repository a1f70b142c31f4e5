"""No number that is none reaches a file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.cli.match import match_document
from nscan_cli.errors import WrongUsageError
from nscan_cli.exports.carmen import corrected_log
from nscan_cli.exports.mcap import ros2_recording
from nscan_cli.files.finite import NotFiniteError, check_finite
from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.map_server import MapImage, gray_image, map_yaml
from nscan_cli.mapping.occupancy import occupancy_grid
from tests.cli.room_logs import room_log
from tests.graph.small_graph import small_graph
from tests.logs.lines import read

WRONG = [math.nan, math.inf, -math.inf]


def spoiled(**changes: object) -> Graph:
    return replace(small_graph(), **changes)  # type: ignore[arg-type]


def with_wrong_pose(value: float) -> Graph:
    graph = small_graph()
    graph.poses[0, 1] = value
    return graph


def trajectory(graph: Graph) -> bytes:
    return write_tum(graph.stamps, graph.poses)


@pytest.fixture
def log(tmp_path) -> LaserLog:
    return read(tmp_path, room_log(3).strip())


@pytest.mark.parametrize("value", WRONG)
def test_numbers_that_are_none_are_named(value):
    check_finite("a pose", np.zeros(3), None, 1.0)
    with pytest.raises(NotFiniteError, match="a pose: a number is not finite, and nothing is written"):
        check_finite("a pose", np.zeros(3), [0.0, value])


@pytest.mark.parametrize("value", WRONG)
@pytest.mark.parametrize("write", [write_graph, write_g2o, trajectory], ids=["JSON", "g2o", "TUM"])
def test_a_pose(write: Callable[[Graph], bytes], value):
    write(small_graph())
    with pytest.raises(NotFiniteError):
        write(with_wrong_pose(value))


@pytest.mark.parametrize("write", [write_graph, write_g2o], ids=["JSON", "g2o"])
def test_a_relation(write: Callable[[Graph], bytes]):
    for field in ("measurement", "information"):
        graph = small_graph()
        getattr(graph.pairwise[0], field)[0] = math.nan
        with pytest.raises(NotFiniteError):
            write(graph)


def test_the_rest_of_a_graph():
    hessian = small_graph()
    hessian.nscan[0].hessian[3, 3] = math.nan
    scored = small_graph()
    scored.pairwise[0] = replace(scored.pairwise[0], score=math.inf)
    marginal = spoiled(marginals={2: np.full((3, 3), math.nan)})
    odometry = spoiled(odometry=np.full((3, 3), math.inf))
    for graph in (hessian, scored, marginal, odometry):
        with pytest.raises(NotFiniteError):
            write_graph(graph)
    with pytest.raises(ValueError, match="Out of range float"):
        write_graph(spoiled(provenance={"parameters": {"x": math.nan}}))
    with pytest.raises(ValueError, match="Out of range float"):
        match_document("x", {}, {"energy": math.nan})


@pytest.mark.parametrize("value", WRONG)
def test_exports(log, value):
    rows, graph = np.arange(3), small_graph()
    with pytest.raises(NotFiniteError):
        corrected_log(log, rows, with_wrong_pose(value).poses)
    grid = occupancy_grid(log, rows, graph.poses)
    assert ros2_recording(log, rows, rows, graph, grid)
    with pytest.raises(NotFiniteError):
        ros2_recording(log, rows, rows, with_wrong_pose(value), grid)
    with pytest.raises(NotFiniteError):
        map_yaml("map.png", MapImage(gray_image(grid), 0.05, (value, 0.0)))


def test_stamps_that_ros_has_no_room_for_are_wrong_usage(log):
    graph = spoiled(stamps=["-2155760000", "0", "976052898.5"])
    grid = occupancy_grid(log, np.arange(3), graph.poses)
    with pytest.raises(WrongUsageError, match="span 99 years, and those of ROS 68 at most"):
        ros2_recording(log, np.arange(3), np.arange(3), graph, grid)
