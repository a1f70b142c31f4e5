"""The whole loop: on the simulated office with its true poses, on odd logs, on real ones."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.evaluation.relations import read_relations, relation_errors
from nscan_cli.evaluation.trajectory import trajectory_errors
from nscan_cli.graph.json_file import parse_graph, write_graph
from nscan_cli.graph.model import Graph
from nscan_cli.graph.solve import optimise_graph
from nscan_cli.graph.tum import Trajectory
from nscan_cli.logs.scan import LaserLog
from nscan_cli.poses import relative, wrap
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import Slam
from tests.data import data_file
from tests.simulation.scenes import office
from tests.slam.runs import (
    Mapped,
    mapped,
    mapped_office,
    mapped_real,
    office_log,
    office_unrefined,
    part,
    truth_of,
    without_returns,
)

ODOMETRY = pytest.mark.parametrize("odometry", [True, False], ids=["odometry", "no odometry"])
CORRIDOR = slice(1880, 2080)
"""Rows of the office in which the robot drives 22 m of corridor."""


@ODOMETRY
def test_the_office_is_mapped_to_five_centimetres(odometry):
    """ATE after alignment, over the 243 m; ranges are good to 15 mm."""
    log, graph = mapped_office(odometry).log, mapped_office(odometry).graph
    found, truth = (Trajectory(log.times, poses, log.stamps) for poses in (graph.poses, truth_of(log)))
    errors = trajectory_errors(found, truth)
    assert errors.matched == len(log)
    assert errors.absolute_translation.rmse < 0.05
    assert errors.absolute_rotation.rmse < 0.5


@ODOMETRY
def test_loops_mend_what_tracking_got_wrong(odometry):
    """Tracking alone drifts over the way; the joint matches bring the second round to the first."""
    office = mapped_office(odometry)
    log = office.log
    truth = truth_of(log)
    rmse = [
        trajectory_errors(
            Trajectory(log.times, poses, log.stamps), Trajectory(log.times, truth, log.stamps)
        ).absolute_translation.rmse
        for poses in (np.array(office.slam.tracked), office.graph.poses)
    ]
    assert rmse[1] < 0.9 * rmse[0]


@ODOMETRY
def test_two_runs_give_the_same_bytes(odometry):
    log = part(office_log(odometry), slice(0, 800))
    assert write_graph(mapped(log).graph) == write_graph(mapped(log).graph)


@ODOMETRY
def test_every_scan_has_a_pose_and_an_anchor_that_is_a_keyframe_not_after_it(odometry):
    log, graph = mapped_office(odometry).log, mapped_office(odometry).graph
    assert graph.poses.shape == (len(log), 3)
    assert np.isfinite(graph.poses).all()
    assert (np.abs(graph.poses[:, 2]) <= np.pi).all()
    np.testing.assert_array_equal(graph.scans, log.numbers)
    assert graph.stamps == list(log.stamps)
    assert (graph.odometry is not None) is odometry
    rows = np.arange(len(log))
    assert (graph.anchors <= rows).all()
    np.testing.assert_array_equal(graph.anchors[graph.anchors], graph.anchors)
    # The nearest keyframe before, none skipped.
    last = graph.keyframes[np.searchsorted(graph.keyframes, rows, side="right") - 1]
    np.testing.assert_array_equal(graph.anchors, last)
    np.testing.assert_allclose(graph.poses[0], 0, atol=1e-12)


def test_keyframes_are_as_far_apart_as_the_options_say():
    office, options = mapped_office(True), SlamOptions().keyframes
    tracked = np.array(office.slam.tracked)
    off = relative(tracked, tracked[office.graph.anchors])
    assert np.hypot(off[:, 0], off[:, 1]).max() <= options.distance
    assert np.abs(off[:, 2]).max() <= options.turn
    keyframes = office.graph.keyframes
    step = relative(tracked[keyframes[1:]], tracked[keyframes[:-1]])
    far = (np.hypot(step[:, 0], step[:, 1]) > options.distance) | (np.abs(step[:, 2]) > options.turn)
    assert far.all()


def test_relations_connect_keyframes_only():
    graph, options = mapped_office(True).graph, SlamOptions().nscan
    keyframes = graph.keyframes
    chain = list(zip(keyframes[:-1].tolist(), keyframes[1:].tolist(), strict=True))
    assert [relation.nodes for relation in graph.pairwise] == chain
    assert len(graph.nscan) > 0.9 * len(keyframes)
    # Each keyframe is the centre of one match at most, which holds the gauge.
    centres = [relation.nodes[relation.fixed] for relation in graph.nscan]
    assert centres == sorted(set(centres))
    for relation in graph.nscan:
        assert set(relation.nodes) <= set(keyframes.tolist())
        assert 3 <= len(relation.nodes) <= options.max_scans
        assert list(relation.nodes) == sorted(set(relation.nodes))


def test_on_the_way_the_newest_keyframe_is_the_centre():
    graph = office_unrefined()
    newest = [relation.nodes[-1] for relation in graph.nscan]
    assert [relation.nodes[relation.fixed] for relation in graph.nscan] == newest
    assert newest == sorted(set(newest))
    # The last one too, after which no keyframe comes.
    assert newest[-1] == graph.keyframes[-1]


def test_loops_are_recorded():
    """The second round, of 75 m, is matched with the first; its keyframes are 1.5 m apart at most."""
    graph = office_unrefined()
    assert len(graph.loops) >= 40
    accepted = [loop for loop in graph.loops if loop.accepted]
    closing = [relation for relation in graph.nscan if relation.origin == "loop"]
    assert [loop.nodes[1] for loop in accepted] == [relation.nodes[-1] for relation in closing]
    assert [loop.score for loop in accepted] == [relation.score for relation in closing]
    for loop in graph.loops:
        assert loop.nodes[0] < loop.nodes[1]
        assert set(loop.nodes) <= set(graph.keyframes.tolist())
        assert loop.accepted or loop.reason


def test_marginals_grow_from_the_first_keyframe_on():
    graph = mapped_office(True).graph
    assert set(graph.marginals) == set(graph.keyframes.tolist())
    np.testing.assert_allclose(graph.marginals[0], 0, atol=1e-12)
    for node, covariance in graph.marginals.items():
        assert node == 0 or np.linalg.eigvalsh(covariance)[0] > 0


@ODOMETRY
def test_read_back_and_optimised_again_it_hardly_moves(odometry):
    graph = mapped_office(odometry).graph
    again = parse_graph(write_graph(graph), "graph.json")
    optimum = optimise_graph(again)
    assert (optimum.converged, optimum.components) == (True, 1)
    off = relative(again.poses, graph.poses)
    assert np.hypot(off[:, 0], off[:, 1]).max() < 1e-3
    assert np.abs(off[:, 2]).max() < 1e-4


def test_progress_is_reported_scan_by_scan():
    said: list[tuple[int, int]] = []
    log = part(office_log(), slice(0, 60))
    graph = Slam(log, SlamOptions()).run(lambda done, keyframes: said.append((done, keyframes)))
    assert [done for done, _ in said] == list(range(1, 61))
    assert said[0][1] == 1
    assert said[-1][1] == len(graph.keyframes)


def test_scan_numbers_are_those_of_the_log():
    log = part(office_log(), np.arange(300, 600, 3))
    graph = mapped(log).graph
    np.testing.assert_array_equal(graph.scans, np.arange(300, 600, 3))
    assert graph.keyframes[0] == 0


# ----------------------------------------------------------------------------- odd logs


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
    graph = sound(part(office_log(odometry), slice(700, 701)))
    np.testing.assert_array_equal(graph.poses, np.zeros((1, 3)))
    assert graph.keyframes.tolist() == [0]
    assert [*graph.pairwise, *graph.nscan, *graph.loops] == []


@ODOMETRY
@pytest.mark.parametrize(("second", "keyframes"), [(201, [0]), (217, [0, 1])], ids=["near", "far"])
def test_a_log_of_two_scans(odometry, second, keyframes):
    """0.1 m and 1.6 m apart; the far one is found with odometry only."""
    log = part(office_log(odometry), np.array([200, second]))
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
    log = without_returns(part(office_log(odometry), CORRIDOR), np.arange(5, 200, 5), reading)
    graph = sound(log)
    assert off_truth(graph, log) < 0.1
    assert len(graph.keyframes) > 10


@ODOMETRY
def test_a_stretch_of_nothing_but_no_returns(odometry):
    """3.3 m blind: with odometry the way goes on by it; without, as the robot drove last."""
    log = without_returns(part(office_log(odometry), CORRIDOR), np.arange(60, 90))
    graph = sound(log)
    assert off_truth(graph, log) < (0.1 if odometry else 1.0)
    truth = truth_of(log)
    # When it sees again, what is before and what is behind are one map.
    end = relative(graph.poses[-1], graph.poses[0]) - relative(truth[-1], truth[0])
    assert np.hypot(end[0], end[1]) < 0.1


def test_a_log_that_is_blind_at_its_start_and_its_end():
    log = part(office_log(), CORRIDOR)
    for rows in (np.arange(30), np.arange(140, 200), np.arange(200)):
        blind = without_returns(log, rows)
        # The odometry's scale is 1 % off: 0.22 m on this way, and it veers.
        assert off_truth(sound(blind), blind) < 0.7


def test_a_log_that_is_blind_throughout_and_without_odometry():
    graph = sound(without_returns(part(office_log(False), CORRIDOR), np.arange(200)))
    np.testing.assert_array_equal(graph.poses, 0)


def test_without_odometry_a_first_scan_that_sees_nothing_is_no_end():
    log = without_returns(part(office_log(False), CORRIDOR), np.array([0]))
    graph = sound(log)
    assert len(graph.keyframes) > 10
    assert off_truth(graph, log) < 0.3


# ----------------------------------------------------------------------------- real logs


def real(name: str) -> tuple[Mapped, float]:
    """A real log mapped, and its mean translational error (m) on the reference relations."""
    run = mapped_real(name)
    relations = read_relations(str(data_file(f"{name}.relations")))
    trajectory = Trajectory(run.log.times, run.graph.poses, run.log.stamps)
    errors = relation_errors(trajectory, relations, name)
    assert errors.too_far == 0
    return run, errors.translation_spread.mean


@pytest.mark.logs
@pytest.mark.parametrize(("name", "bound"), [("intel", 0.025), ("fr079", 0.045), ("mit-csail", 0.045)])
def test_a_real_log_is_mapped(name, bound):
    """Bounds between what is reached (0.013, 0.031, 0.027 m) and the best that is published."""
    run, mean = real(name)
    assert mean <= bound
    accepted = [loop for loop in run.graph.loops if loop.accepted]
    assert len(accepted) > 50
    assert all(loop.reason for loop in run.graph.loops if not loop.accepted)


@pytest.mark.logs
def test_the_largest_log_runs_to_its_end():
    run, _ = real("mit-killian")
    assert len(run.graph) == 17480
    assert np.isfinite(run.graph.poses).all()
    assert len(write_graph(run.graph)) < 10_000_000
