"""The whole loop on logs that are short, that stand still, or that see nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import relative, wrap
from tests.logs.excerpts import excerpt, truth_of
from tests.simulation.faults import without_returns
from tests.simulation.scenes import office
from tests.slam.mapped_logs import mapped, office_log

ODOMETRY = pytest.mark.parametrize("odometry", [True, False], ids=["odometry", "no odometry"])
CORRIDOR = slice(1880, 2080)
"""Rows of the office in which the robot drives 22 m of corridor."""


def sound(log: LaserLog) -> Graph:
    """The graph of a log; it can be written and read, and no number in it is not finite."""
    with np.errstate(divide="raise", invalid="raise"):
        graph = mapped(log).graph
    back = parse_graph(write_graph(graph), "graph.json")
    assert len(back) == len(log)
    np.testing.assert_allclose(back.poses[:, :2], graph.poses[:, :2], atol=1e-8)
    return graph


def off_truth(graph: Graph, log: LaserLog) -> float:
    """The largest error (m) of a position seen from the first scan."""
    truth = truth_of(log)
    off = relative(graph.poses, graph.poses[0]) - relative(truth, truth[0])
    return float(np.hypot(off[:, 0], off[:, 1]).max())


@ODOMETRY
def test_a_log_of_one_scan(odometry):
    graph = sound(excerpt(office_log(odometry), slice(700, 701)))
    np.testing.assert_array_equal(graph.poses, np.zeros((1, 3)))
    assert graph.keyframes.tolist() == [0]
    assert [*graph.pairwise, *graph.nscan, *graph.loops] == []


@ODOMETRY
@pytest.mark.parametrize(("second", "keyframes"), [(201, [0]), (219, [0, 1])], ids=["near", "far"])
def test_a_log_of_two_scans(odometry, second, keyframes):
    """0.1 m and 1.8 m apart; the far one is found with odometry only."""
    log = excerpt(office_log(odometry), np.array([200, second]))
    graph = sound(log)
    assert graph.nscan == []
    assert len(graph.pairwise) == len(graph.keyframes) - 1
    if odometry:
        assert graph.keyframes.tolist() == keyframes
        assert off_truth(graph, log) < 0.05


@ODOMETRY
def test_a_robot_that_stands_still(odometry):
    """Every scan sees the first one's map: the noise of a match does not add up."""
    log = office().record_at(np.repeat(office().truth()[1900:1901], 100, axis=0), seed=2).log()
    if not odometry:
        log = dataclasses.replace(log, odometry=None)
    graph = sound(log)
    assert graph.keyframes.tolist() == [0]
    assert off_truth(graph, log) < 0.03
    assert np.abs(wrap(graph.poses[:, 2])).max() < 0.01


@ODOMETRY
@pytest.mark.parametrize("reading", [np.inf, np.nan], ids=["no return", "no reading"])
def test_scans_without_a_usable_beam_in_between(odometry, reading):
    log = without_returns(excerpt(office_log(odometry), CORRIDOR), np.arange(5, 200, 5), reading)
    graph = sound(log)
    assert off_truth(graph, log) < 0.1
    assert len(graph.keyframes) > 10


@ODOMETRY
def test_a_stretch_of_nothing_but_no_returns(odometry):
    """3.3 m blind: with odometry the way goes on by it; without, as the robot drove last."""
    log = without_returns(excerpt(office_log(odometry), CORRIDOR), np.arange(60, 90))
    graph = sound(log)
    assert off_truth(graph, log) < (0.1 if odometry else 1.0)
    truth = truth_of(log)
    # When it sees again, what is before and what is behind are one map.
    end = relative(graph.poses[-1], graph.poses[0]) - relative(truth[-1], truth[0])
    assert np.hypot(end[0], end[1]) < 0.1


def test_a_log_that_is_blind_at_its_start_and_its_end():
    log = excerpt(office_log(), CORRIDOR)
    for rows in (np.arange(30), np.arange(140, 200), np.arange(200)):
        blind = without_returns(log, rows)
        # The odometry's scale is 1 % off: 0.22 m on this way, and it veers.
        assert off_truth(sound(blind), blind) < 0.7


def test_a_log_that_is_blind_throughout_and_without_odometry():
    graph = sound(without_returns(excerpt(office_log(False), CORRIDOR), np.arange(200)))
    np.testing.assert_array_equal(graph.poses, 0)


def test_without_odometry_a_first_scan_that_sees_nothing_is_no_end():
    log = without_returns(excerpt(office_log(False), CORRIDOR), np.array([0]))
    graph = sound(log)
    assert len(graph.keyframes) > 10
    assert off_truth(graph, log) < 0.3
