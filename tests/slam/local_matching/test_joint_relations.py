"""Step 3: the joint match of a keyframe with those near it."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from nscan_cli.matching.joint.gauge import gauge_directions
from nscan_cli.matching.joint.joint_energy import JointProblem
from nscan_cli.matching.joint.joint_match import JointMatch, match_jointly
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.poses import Array, compose, relative, wrap
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import route_of
from nscan_cli.slam.local_matching import joint_relations
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, match_at, match_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from tests.matching.problems import office_truth
from tests.simulation.scenes import office
from tests.slam.keyframe_drives import (
    CABINETS,
    about,
    keyframe_of,
    like_doors_drive,
    path_of,
    relation_to_previous,
)

OLD, BETWEEN, NEW = (280, 290, 300, 310, 320), (700, 1200), (1880, 1890, 1900, 1910, 1920)
"""Rows of the office: along the corridor to the south; elsewhere; and along it again, 150 m later."""


@functools.cache
def keyframe(row: int, place: int) -> Keyframe:
    """A keyframe that was tracked without an error where `row` says, but saw what is at `place`.

    Scans 22 and 44 cm before and after it grow its Gaussians, as in the loop.
    """
    truth = office_truth()
    path = float(path_of(truth)[row])
    return keyframe_of(office(), row, truth[row], path, truth[place + np.array([0, -4, -2, 2, 4])])


ROWS = (*OLD, *BETWEEN, *NEW)


def revisit(foreign: dict[int, int] | None = None) -> list[Keyframe]:
    """The two drives along the corridor; `foreign` says which rows see another place's scan."""
    return [keyframe(row, (foreign or {}).get(row, row)) for row in ROWS]


def matched(
    keyframes: list[Keyframe],
    off: Array,
    options: NScanOptions = NScanOptions(),
) -> LocalMatch:
    """Match the last keyframe when all of the second drive are off the truth by one motion."""
    poses = office_truth()[list(ROWS)]
    new = slice(len(OLD) + len(BETWEEN), None)
    centre = poses[new].mean(axis=0) * [1, 1, 0]
    poses[new] = compose(compose(centre, off), relative(poses[new], centre))
    pairwise = [relation_to_previous(keyframes[: k + 2]) for k in range(len(keyframes) - 1)]
    found = about(match_neighbours, route_of(keyframes, pairwise, poses), len(keyframes) - 1, options)
    assert found is not None
    return found


def off_truth(found: LocalMatch) -> Array:
    """(n, 3) errors of a relation's poses, seen from its fixed one."""
    assert found.nscan is not None
    relation, truth = found.nscan, office_truth()
    off = relative(relation.poses, relation.poses[relation.fixed]) - relative(
        truth[list(relation.nodes)], truth[relation.nodes[relation.fixed]]
    )
    off[:, 2] = wrap(off[:, 2])
    return off


@pytest.mark.parametrize(
    "off",
    [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (-0.2, 0.22, np.radians(2)), (0.2, -0.22, -np.radians(2))],
)
def test_a_revisit_is_brought_back_to_the_truth(off):
    """Ranges are good to 15 mm; the centimetres are those of cells of 0.5 m and 180 beams."""
    keyframes = revisit()
    found = matched(keyframes, np.array(off))
    assert found.nscan is not None
    assert found.loop is not None
    assert (found.loop.accepted, found.loop.reason) == (True, "")
    assert found.loop.nodes == (found.nscan.nodes[0], ROWS[-1])
    assert found.whole
    assert len(set(found.nscan.nodes) & set(OLD)) >= 3
    assert len(set(found.nscan.nodes) & set(NEW)) >= 3
    errors = off_truth(found)
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.04
    assert np.abs(errors[:, 2]).max() < np.radians(0.5)
    assert found.moved == pytest.approx(np.hypot(off[0], off[1]), abs=0.2)


def test_nodes_fixed_origin_and_score():
    keyframes = revisit()
    found = matched(keyframes, np.array([0.1, 0.1, 0.01]))
    relation = found.nscan
    assert relation is not None
    assert relation.nodes == tuple(sorted(relation.nodes))
    assert relation.nodes[relation.fixed] == ROWS[-1]
    assert relation.origin == "loop"
    assert relation.poses.shape == (len(relation.nodes), 3)
    assert found.loop is not None
    assert NScanOptions().min_overlap <= relation.score == found.loop.score <= 1


def test_without_a_revisit_the_relation_closes_no_loop():
    keyframes = revisit()[: len(OLD)]
    truth = office_truth()[list(OLD)]
    pairwise = [relation_to_previous(keyframes[: k + 2]) for k in range(len(keyframes) - 1)]
    found = about(match_neighbours, route_of(keyframes, pairwise, truth), len(OLD) - 1, NScanOptions())
    assert found is not None
    assert found.nscan is not None
    assert (found.loop, found.nscan.origin) == (None, "nscan")
    assert found.moved < 0.05


def test_the_hessian_is_positive_semi_definite_and_the_gauge_is_its_null_space():
    relation = matched(revisit(), np.array([0.1, 0.1, 0.01])).nscan
    assert relation is not None
    np.testing.assert_allclose(relation.hessian, relation.hessian.T, rtol=1e-9, atol=1e-6)
    values = np.linalg.eigvalsh(relation.hessian)
    assert values[0] > -1e-9 * values[-1]
    assert np.abs(values[:3]).max() < 1e-3 * values[3]
    moved = relation.hessian @ gauge_directions(relation.poses)
    assert np.linalg.norm(moved, axis=0).max() < 1e-2 * values[3]


def test_a_foreign_scan_is_left_out_and_named_in_the_reason():
    """One of the old ones saw a room instead of the corridor."""
    foreign = {300: 1320}
    found = matched(revisit(foreign), np.array([0.1, 0.1, 0.01]))
    assert found.nscan is not None
    assert 300 not in found.nscan.nodes
    assert not found.whole
    assert found.loop is not None
    assert (found.loop.accepted, found.loop.reason) == (True, "1 scan left out")
    errors = off_truth(found)
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.04


@pytest.mark.parametrize(
    ("foreign", "overlap", "attempts"),
    [({}, 0.65, 1), ({}, 0.95, 1), ({300: 1320}, 0.65, 2)],
    ids=["all hang together", "one takes part and is left out", "one cannot take part"],
)
def test_all_stages_are_run_for_what_the_last_one_cannot_try(foreign, overlap, attempts, monkeypatch):
    stages = []

    def watched(problem: JointProblem, start: Array, options: JointOptions) -> JointMatch:
        stages.append(len(options.widenings))
        return match_jointly(problem, start, options)

    monkeypatch.setattr(joint_relations, "match_jointly", watched)
    found = matched(revisit(foreign), np.zeros(3), NScanOptions(min_overlap=overlap))
    assert found.whole == (overlap == 0.65 and not foreign)
    assert sorted(set(stages)) == [1, 3][:attempts]


def test_a_newest_scan_that_is_foreign_is_refused_with_a_reason():
    found = matched(revisit({NEW[-1]: 1320}), np.zeros(3))
    assert found.nscan is None
    assert found.loop is not None
    assert not found.loop.accepted
    assert found.loop.reason == f"only 1 of {len(OLD) + len(NEW)} scans match each other"


def test_a_match_that_does_not_converge_is_refused_with_a_reason():
    found = matched(revisit(), np.array([0.3, 0.2, 0.05]), NScanOptions(max_iterations=0))
    assert found.nscan is None
    assert found.loop is not None
    assert (found.loop.accepted, found.loop.reason) == (False, "did not converge")
    assert len(found.alike) == len(OLD) + len(NEW)


def test_when_all_that_was_seen_before_is_left_out_no_loop_is_closed():
    """A place that only seemed to be seen before: what is left is a relation of the recent scans."""
    found = matched(revisit(dict.fromkeys(OLD, 1320)), np.zeros(3))
    assert found.nscan is not None
    assert not set(found.nscan.nodes) & set(OLD)
    assert found.nscan.origin == "nscan"
    assert found.loop is not None
    assert not found.loop.accepted
    assert "left out" in found.loop.reason


def test_two_keyframes_are_too_few():
    keyframes = revisit()[:2]
    two = route_of(keyframes, [relation_to_previous(keyframes)], office_truth()[[280, 290]])
    alone = route_of(keyframes, [], office_truth()[[280]])
    assert about(match_neighbours, two, 1, NScanOptions()) is None
    assert about(match_neighbours, alone, 0, NScanOptions()) is None


def test_places_are_compared_by_the_same_scans_whichever_the_graph_has():
    """The true place and one a door off, with this visit at either, and asked for in either order."""
    doors, centre = like_doors_drive(CABINETS), 20
    paths = np.array([keyframe.tracked.path for keyframe in doors.keyframes])
    wrong, visit = doors.truth.copy(), paths > 40.0
    wrong[visit] += [3.0, 0.0, 0.0]
    places = doors.truth[centre], wrong[centre]
    (right_energy, right), (wrong_energy, off) = match_at(
        route_of(doors.keyframes, doors.chain, doors.truth), centre, places, NScanOptions()
    )
    np.testing.assert_allclose(right, places[0], atol=0.03)
    np.testing.assert_allclose(off, places[1], atol=0.06)
    # Of a door's match a tenth is at the cabinets.
    assert right_energy < 1.1 * wrong_energy
    other, one = match_at(route_of(doors.keyframes, doors.chain, wrong), centre, places[::-1], NScanOptions())
    assert [one[0], other[0]] == pytest.approx([right_energy, wrong_energy], rel=1e-3)
