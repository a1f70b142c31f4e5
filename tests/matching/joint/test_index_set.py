from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from nscan_cli.matching.joint.index_set import index_set, overlap_shares
from nscan_cli.matching.joint.joint_energy import all_pairs
from nscan_cli.matching.joint.joint_match import match_near_and_far
from nscan_cli.matching.joint.options import IndexSetOptions, JointOptions
from nscan_cli.ndt.hash_grid import find_row, pack_key
from nscan_cli.poses import Array, relative, transform
from tests.matching.problems import Problem, errors, fig_3, near, office_problem
from tests.simulation.scenes import office
from tests.simulation.world import World

ROWS = tuple(range(0, 400, 40))
"""Out of a room, along the corridor, and into another room."""

OPTIONS = IndexSetOptions()


@pytest.fixture(scope="module")
def ten() -> Problem:
    return office_problem(ROWS, noise=False)


@cache
def plan() -> World:
    return office().world


def as_set(found: np.ndarray) -> set[tuple[int, int]]:
    return {(int(i), int(j)) for i, j in found}


@pytest.mark.parametrize("kind", ["all", "visible", "overlap"])
def test_pairs_go_both_ways_and_are_sorted(ten, kind):
    found = index_set(kind, OPTIONS, ten.joint().scans, ten.truth)
    assert found.dtype == np.int64
    assert found.flags.c_contiguous
    assert found.tolist() == sorted(found.tolist())
    assert as_set(found) == as_set(found[:, ::-1])
    assert (found[:, 0] != found[:, 1]).all()
    if kind == "all":
        assert found.tolist() == all_pairs(10).tolist()
    else:
        assert 20 < len(found) < 60


def sees(i: np.ndarray, j: np.ndarray) -> bool | None:
    """Whether a robot at pose i sees position j by the floor plan; None where it is a close call."""
    distance = np.hypot(*(j - i)[:2])
    u = relative(j, i)
    beyond = abs(np.arctan2(u[1], u[0])) - np.pi / 2
    on_the_way = i[:2] + np.linspace(0, 1, 100)[:, None] * (j - i)[:2]
    clearance = plan().clearance(on_the_way).min()
    through = crosses_a_wall(i[:2], j[:2])
    if not through and (
        clearance < 2 * OPTIONS.beam_angle * distance or abs(beyond) < 2 * OPTIONS.beam_angle + 0.1 / distance
    ):
        return None
    return not through and beyond < 0


def crosses_a_wall(a: Any, b: Any) -> bool:
    def side(p: Any, q: Any, r: Any) -> Any:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    for x1, y1, x2, y2 in plan().segments:
        c, d = (x1, y1), (x2, y2)
        if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
            return True
    return False


def test_visible_is_what_the_floor_plan_leaves_free(ten):
    found = as_set(index_set("visible", OPTIONS, ten.joint().scans, ten.truth))
    told = {True: 0, False: 0}
    for i in range(10):
        for j in range(i):
            ways = [sees(ten.truth[i], ten.truth[j]), sees(ten.truth[j], ten.truth[i])]
            if True in ways or None not in ways:
                seen = True in ways
                assert ((i, j) in found) == seen
                told[seen] += 1
    assert told[True] > 5
    assert told[False] > 15


def test_a_position_at_hand_is_visible_however_the_robot_is_turned(ten):
    poses = np.array([[0.0, 0, 0], [-0.2, 0, 0], [-0.2, 0, np.pi], [-2.0, 0, 0]])
    scans = ten.joint(4, 4, 4, 4).scans
    back = relative(poses[1], poses[0])
    assert back[0] < 0
    found = as_set(index_set("visible", OPTIONS, scans, poses))
    assert {(0, 1), (0, 2), (1, 2)} <= found


def faces(gaussians: Array, link: int, beam: Array) -> bool:
    """Whether a Gaussian, or that of the wall's other face, shows its side to a beam (2,)."""
    other = int(gaussians[link, 7])
    rows = [link, other] if other else [link]
    return any(gaussians[row, 5:7] @ beam <= 0 for row in rows)


def test_overlap_is_the_share_of_points_in_cells_with_gaussians(ten):
    """Against a count in plain Python of every third point; sides are taken from the Gaussians."""
    scans = ten.joint().scans
    shares = overlap_shares(scans, ten.truth, OPTIONS.stride)
    for i in range(10):
        grid, half = ten.ndts[i].grid, ten.ndts[i].half
        for j in range(10):
            points = ten.points[j][::3]
            u = relative(ten.truth[j], ten.truth[i])
            moved, beams = transform(u, points), transform([0, 0, u[2]], points)
            hits = 0
            for (x, y), beam in zip(moved, beams, strict=True):
                row = find_row(grid, pack_key(int(np.floor(x / half)), int(np.floor(y / half))))
                links = grid.links[row] if row >= 0 else []
                hits += any(link >= 0 and faces(grid.gaussians, link, beam) for link in links)
            assert shares[i, j] == pytest.approx(hits / len(points) if i != j else 0.0)


def test_pairs_with_little_in_common_can_be_what_ties_all_together():
    """The paper's Fig. 3: scans 2 and 3 share a cabinet only."""
    scans = fig_3(noise=True)
    assert as_set(index_set("overlap", OPTIONS, scans.joint().scans, scans.truth)) == as_set(all_pairs(3))


def test_a_scan_keeps_the_one_that_it_has_most_in_common_with(ten):
    none_by_share = IndexSetOptions(least_share=2.0)
    scans = ten.joint().scans
    found = index_set("overlap", none_by_share, scans, ten.truth)
    assert np.unique(found).tolist() == list(range(10))
    assert len(found) < 20


@pytest.mark.parametrize("kind", ["visible", "overlap"])
def test_a_scan_far_away_is_in_no_pair(ten, kind):
    poses = ten.truth.copy()
    poses[3] += [200, 0, 0]
    found = index_set(kind, OPTIONS, ten.joint().scans, poses)
    assert 3 not in found
    assert 0 in found


@pytest.mark.parametrize("fixed", [None, 0, 2])
def test_a_scan_in_no_pair_stays_and_the_others_match_as_without_it(fixed):
    four = office_problem((2000, 2008, 2016, 2024))
    start = near(four.truth, 1)
    start[2] += [200, 0, 0]
    problem, options = four.joint(), JointOptions(fixed=fixed)
    match = match_near_and_far(problem, start, options, partial(index_set, "overlap", OPTIONS, problem.scans))
    assert match.converged
    assert np.unique(match.pairs).tolist() == [0, 1, 3]
    if fixed is not None:
        # In a free gauge all may turn about their centre, and a scan that nothing holds against that.
        np.testing.assert_allclose(match.poses[2], start[2], atol=1e-6)
    assert not match.hessian[6:9].any()
    assert np.abs(errors(match.poses[[0, 1, 3]], four.truth[[0, 1, 3]])[:, :2]).max() < 0.03


def test_pairs_are_chosen_again_as_the_poses_move():
    """Before every stage of both approaches, and before the last steps."""
    four = office_problem((2000, 2008, 2016, 2024))
    problem, options = four.joint(), JointOptions()
    start = near(four.truth, 2, 0.3, 0.1)
    chosen = []

    def pairs_at(poses):
        chosen.append(poses.copy())
        return all_pairs(4)[len(chosen) :]

    match = match_near_and_far(problem, start, options, pairs_at)
    stages = len(options.widenings)
    assert len(chosen) == stages + 2
    np.testing.assert_array_equal(chosen[0], start)
    np.testing.assert_array_equal(chosen[stages], start)
    moved = np.abs(np.array(chosen) - start).max(axis=(1, 2))
    assert (np.delete(moved, [0, stages]) > 0.1).all()
    assert match.pairs.tolist() == all_pairs(4)[stages + 2 :].tolist()
