"""Step 3 in pairs: a keyframe matched with each of those near it alone."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.model import Pairwise
from nscan_cli.ndt.energy import energy
from nscan_cli.poses import Array, compose, relative, wrap
from nscan_cli.slam.frontend.tracked_scans import TrackedScan
from nscan_cli.slam.keyframes.keyframe import Keyframe, KeyframePoints
from nscan_cli.slam.keyframes.route import route_of
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.local_matching.pairwise_relations import match_neighbours_pairwise
from tests.matching.problems import office_truth
from tests.slam.keyframe_drives import about, relation_to_previous
from tests.slam.local_matching.test_joint_relations import BETWEEN, NEW, OLD, ROWS, revisit

OFF = np.array([0.1, 0.1, 0.01])


def matched(keyframes: list[Keyframe], off: Array = OFF, centre: int = len(ROWS) - 1) -> LocalMatch:
    """Match a keyframe when all of the second drive are off the truth by one motion."""
    poses = office_truth()[list(ROWS)]
    new = slice(len(OLD) + len(BETWEEN), None)
    middle = poses[new].mean(axis=0) * [1, 1, 0]
    poses[new] = compose(compose(middle, off), relative(poses[new], middle))
    links = [relation_to_previous(keyframes[: k + 2]) for k in range(len(keyframes) - 1)]
    found = about(match_neighbours_pairwise, route_of(keyframes, links, poses), centre, NScanOptions())
    assert found is not None
    return found


def off_truth(relation: Pairwise) -> Array:
    truth = office_truth()
    off = relation.measurement - relative(truth[relation.nodes[1]], truth[relation.nodes[0]])
    off[2] = wrap(off[2])
    return off


def test_every_match_is_a_relation_near_the_truth_of_its_own():
    found = matched(revisit())
    assert found.nscan is None
    # The first of the new ones is 4.4 m away, and has less than half in common with the last.
    assert not found.whole
    assert [relation.nodes for relation in found.pairwise] == [(row, NEW[-1]) for row in (*OLD, *NEW[1:-1])]
    assert [relation.origin for relation in found.pairwise] == ["loop"] * len(OLD) + ["track"] * 3
    for relation in found.pairwise:
        assert np.abs(off_truth(relation)[:2]).max() < 0.06
        assert abs(off_truth(relation)[2]) < np.radians(0.7)
    assert found.loop is not None
    assert found.loop.nodes == (OLD[0], NEW[-1])
    assert (found.loop.accepted, found.loop.reason) == (True, "1 scan left out")
    assert found.loop.score == max(r.score for r in found.pairwise if r.origin == "loop")
    assert found.moved == pytest.approx(np.hypot(*OFF[:2]), abs=0.1)


def test_the_information_is_the_scaled_energys_without_the_prior():
    keyframes = revisit()
    by_row = {keyframe.row: keyframe for keyframe in keyframes}
    for relation in matched(keyframes).pairwise:
        other, centre = (by_row[node] for node in relation.nodes)
        there = energy(other.ndt, centre.points, relation.measurement, exact=False)
        # Of the points in one lattice cell, half a cell wide, all together count as much as one.
        cells = {(int(x // 0.25), int(y // 0.25)) for x, y in centre.points}
        scale = NScanOptions().scale_per_cell * len(cells) / len(centre.points)
        np.testing.assert_allclose(relation.information, scale * there.hessian, rtol=1e-9)
        assert np.linalg.eigvalsh(relation.information)[0] > 0


def test_a_match_that_knows_nothing_is_no_relation():
    """A wall from both sides: only a scan around the centre has seen the face that the other sees.

    On its Gaussians all points of the other lie, but none of the centre meets one of the other's.
    """
    across = np.linspace(-1.5, 1.5, 61)
    wall, options = np.column_stack([np.full(61, 2.0), across]), NScanOptions().gaussians

    def seen_from(pose: Array) -> KeyframePoints:
        return KeyframePoints(wall, np.array([len(wall)]), pose[None])

    def at(row: int, pose: list[float], *around: KeyframePoints) -> Keyframe:
        here = TrackedScan(np.array(pose), np.eye(3), np.eye(3), 1.0, 50.0 * row, True)
        return Keyframe(row, here, np.eye(3), wall, 13, options, [seen_from(here.pose), *around])

    one = at(0, [0.0, 0.0, 0.0])
    keyframes = [one, at(1, [100.0, 0.0, 0.0]), at(2, [4.0, 0.0, np.pi], seen_from(one.tracked.pose))]
    poses = np.array([keyframe.tracked.pose for keyframe in keyframes])
    links = [relation_to_previous(keyframes[: k + 2]) for k in range(2)]
    found = about(match_neighbours_pairwise, route_of(keyframes, links, poses), 2, NScanOptions())
    assert found is not None
    assert found.pairwise == ()
    assert found.loop is not None
    assert not found.loop.accepted
    assert found.loop.score == 0.0


def test_the_centre_may_be_older_than_those_near_it():
    """As when the matches are made again: then the chain's relation holds the other way round."""
    centre = len(ROWS) - 3
    found = matched(revisit(), centre=centre)
    after = [relation for relation in found.pairwise if relation.nodes[0] > relation.nodes[1]]
    assert [relation.nodes for relation in after] == [(row, ROWS[centre]) for row in NEW[-2:]]
    for relation in after:
        assert np.abs(off_truth(relation)).max() < 0.04


@pytest.mark.parametrize("centre", [len(ROWS) - 2, len(ROWS) - 1])
def test_the_chain_holds_two_that_follow_each_other(centre):
    """A prior that is surer than any match keeps the pose, whichever of the two is the centre."""
    keyframes = revisit()
    truth = office_truth()[list(ROWS)]
    links = [relation_to_previous(keyframes[: k + 2]) for k in range(len(keyframes) - 1)]
    wrong = compose(links[-1].measurement, np.array([0.05, 0.03, 0.01]))
    links[-1] = dataclasses.replace(links[-1], measurement=wrong, information=np.diag([1e9, 1e9, 1e9]))
    found = about(match_neighbours_pairwise, route_of(keyframes, links, truth), centre, NScanOptions())
    assert found is not None
    held = {relation.nodes: relation for relation in found.pairwise}
    if centre == len(ROWS) - 1:
        np.testing.assert_allclose(held[NEW[-2], NEW[-1]].measurement, wrong, atol=1e-3)
    else:
        back = relative(np.zeros(3), wrong)
        np.testing.assert_allclose(held[NEW[-1], NEW[-2]].measurement, back, atol=1e-3)


def test_a_foreign_scan_is_left_out_and_named_in_the_reason():
    found = matched(revisit({OLD[0]: 1320}))
    assert OLD[0] not in {relation.nodes[0] for relation in found.pairwise}
    assert not found.whole
    assert found.loop is not None
    assert (found.loop.accepted, found.loop.reason) == (True, "2 scans left out")
    assert found.loop.nodes == (OLD[1], NEW[-1])


def test_when_nothing_of_another_visit_overlaps_the_loop_is_refused_with_a_reason():
    found = matched(revisit(dict.fromkeys(OLD, 1320)))
    assert {relation.origin for relation in found.pairwise} == {"track"}
    assert found.loop is not None
    assert found.loop.nodes == (OLD[0], NEW[-1])
    assert not found.loop.accepted
    assert found.loop.reason == f"too little overlap with {len(OLD)} scans of another visit"
    assert 0 < found.loop.score < NScanOptions().min_overlap


def test_a_keyframe_alone_is_matched_with_nothing():
    keyframes = revisit()[:1]
    assert (
        about(match_neighbours_pairwise, route_of(keyframes, [], office_truth()[[280]]), 0, NScanOptions())
        is None
    )
