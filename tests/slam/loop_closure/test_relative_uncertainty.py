"""How far keyframes may be off, seen from one of them: against dense formulas, and the bound on the way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import Pairwise
from nscan_cli.poses import Array, compose, relative, relative_jacobians
from nscan_cli.slam.loop_closure.relative_uncertainty import (
    RelativeSigma,
    RelativeUncertainty,
    held_pose_marginals,
)
from tests.slam.keyframe_drives import exact_path
from tests.slam.keyframe_walks import Walk, seen_from, straight, walk


def residuals(walked: Walk, moved: Array) -> Array:
    """All that the relations say is 0, made white, at poses (K, 3): their squares are the energy."""
    parts = []
    for pair in walked.way + walked.loops:
        a, b = pair.nodes
        root = np.linalg.cholesky(pair.information).T
        parts.append(root @ (relative(moved[b], moved[a]) - pair.measurement))
    for relation in walked.nscan:
        nodes, c = list(relation.nodes), relation.fixed
        local = compose(relation.poses[c], relative(moved[nodes], moved[nodes[c]])) - relation.poses
        parts.append(np.linalg.cholesky(relation.hessian).T @ local.ravel())
    return np.concatenate(parts)


def joint_covariance(walked: Walk) -> Array:
    """(3K, 3K) of all poses with the first one held, from derivatives by differences."""
    size, step = walked.poses.size, 1e-6
    columns = []
    for k in range(3, size):
        shift = step * np.eye(size)[k].reshape(-1, 3)
        ahead, back = (residuals(walked, walked.poses + sign * shift) for sign in (1, -1))
        columns.append((ahead - back) / (2 * step))
    jacobian = np.stack(columns, axis=1)
    covariance = np.zeros((size, size))
    covariance[3:, 3:] = np.linalg.inv(jacobian.T @ jacobian)
    return covariance


@pytest.mark.parametrize("origin", [0, 4, 8])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_seen_from_gives_the_marginals_of_relative_poses(seed, origin):
    """u = k ⊖ origin has J Σ Jᵗ, with Σ of both poses from the covariance with keyframe 0 held."""
    walked = walk(seed, 9, loops=3)
    covariance = joint_covariance(walked)
    found = seen_from(walked.energy(origin), walked.poses)
    assert (found.distance[origin], found.angle[origin]) == (0.0, 0.0)
    for k in range(9):
        if k == origin:
            continue
        jacobian = np.hstack(relative_jacobians(walked.poses[k], walked.poses[origin]))
        both = np.r_[3 * k : 3 * k + 3, 3 * origin : 3 * origin + 3]
        marginal = jacobian @ covariance[np.ix_(both, both)] @ jacobian.T
        greatest = np.sqrt(np.linalg.eigvalsh(marginal[:2, :2])[1])
        assert found.distance[k] == pytest.approx(greatest, rel=1e-5)
        assert found.angle[k] == pytest.approx(np.sqrt(marginal[2, 2]), rel=1e-5)


@pytest.mark.parametrize("held", [0, 5, 11])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_from_any_keyframe_it_is_as_if_that_one_were_held(seed, held):
    walked = walk(seed, 12, loops=3)
    asked = held_pose_marginals(walked.energy(held), walked.poses)
    for other in range(12):
        direct, found = seen_from(walked.energy(other), walked.poses), asked.seen_from(other)
        np.testing.assert_allclose(found.distance, direct.distance, rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(found.angle, direct.angle, rtol=1e-8, atol=1e-12)


def test_from_a_keyframe_that_nothing_holds_nothing_is_known_but_of_itself():
    walked = walk(2, 12, loops=3)
    asked = held_pose_marginals(walked.energy(0), walked.poses)
    asked.covariances[7] = np.inf
    with np.errstate(all="raise"):
        found = asked.seen_from(7)
    assert (found.distance[7], found.angle[7]) == (0.0, 0.0)
    assert np.isinf(np.delete(found.distance, 7)).all()
    assert np.isinf(np.delete(found.angle, 7)).all()


def test_what_was_asked_can_be_seen_from_another_keyframe():
    walked, uncertainty = walk(4, 9, loops=2), RelativeUncertainty()
    uncertainty.compute(walked.energy(8), walked.poses)
    found, direct = uncertainty.seen_from(3), seen_from(walked.energy(3), walked.poses)
    np.testing.assert_allclose(found.distance, direct.distance, rtol=1e-8, atol=1e-12)


def test_the_reach_grows_with_the_way():
    """Golden: n steps away √n · 0.1 rad; 0.2² across and, by the angles of the steps between, 0.1² of levers.

    Seen from keyframe 0, keyframe n is swung by the angles at 1, 2, … n − 1, which are n − 1, … 1 steps off.
    """
    reach = seen_from(straight(5).energy(0), straight(5).poses)
    steps = np.arange(5)
    levers = 4.0 * np.array([0, 0, 1, 1 + 4, 1 + 4 + 9])
    np.testing.assert_allclose(reach.angle, 0.1 * np.sqrt(steps), rtol=1e-6)
    np.testing.assert_allclose(reach.distance, np.sqrt(0.2**2 * steps + 0.1**2 * levers), rtol=1e-6)


def test_a_loop_tells_where_one_is():
    open_way = straight(12)
    sure = np.diag([1e4, 1e4, 1e10])
    loop = Pairwise((0, 11), relative(open_way.poses[11], open_way.poses[0]), sure, "loop")
    closed = open_way._replace(loops=[loop])
    before, after = (seen_from(walked.energy(11), walked.poses) for walked in (open_way, closed))
    assert before.distance[0] > 2.0
    assert after.distance[0] == pytest.approx(0.01, rel=0.01)
    assert (after.distance <= before.distance).all()


def asked_and_bound(
    walked: Walk, origin: int, now: int, ahead: int = 0
) -> tuple[RelativeSigma, RelativeSigma]:
    """The bound (now,) for keyframe `now` when `origin` was asked last, and the answer.

    The centre of the loop has keyframes ahead of it already, then as now.
    """
    uncertainty, before, after = (
        RelativeUncertainty(),
        walked.until(origin + ahead + 1),
        walked.until(now + ahead + 1),
    )
    uncertainty.compute(before.energy(origin), before.poses)
    bound = uncertainty.upper_bound(now, exact_path(after.way), after.poses)
    answer = seen_from(after.energy(now), after.poses)
    return RelativeSigma(bound.distance[:now], bound.angle[:now]), RelativeSigma(
        answer.distance[:now], answer.angle[:now]
    )


def test_the_bound_is_the_answer_itself_at_first():
    walked = walk(5, 8, loops=2)
    uncertainty = RelativeUncertainty()
    asked = uncertainty.compute(walked.energy(7), walked.poses)
    bound = uncertainty.upper_bound(7, exact_path(walked.way), walked.poses)
    np.testing.assert_allclose(bound.distance, asked.distance, rtol=1e-12)
    np.testing.assert_allclose(bound.angle, asked.angle, rtol=1e-12)


@given(
    st.integers(0, 10**6), st.integers(2, 6), st.integers(1, 8), st.sampled_from([0, 3]), st.integers(0, 3)
)
@settings(max_examples=100, deadline=None)
def test_the_bound_is_never_too_little(seed, origin, steps, ahead, loops):
    now = origin + steps
    walked = walk(seed, now + ahead + 1, loops, among=origin + 1)
    bound, answer = asked_and_bound(walked, origin, now, ahead)
    assert (bound.distance >= (1 - 1e-6) * answer.distance).all()
    assert (bound.angle >= (1 - 1e-6) * answer.angle).all()


def test_nor_is_it_too_great():
    """On a line nothing is lost: all parts are greatest in the same direction, across."""
    bound, answer = asked_and_bound(straight(12), 5, 11)
    np.testing.assert_allclose(bound.angle, answer.angle, rtol=1e-6)
    np.testing.assert_allclose(bound.distance, answer.distance, rtol=1e-6)


def test_before_anything_was_asked_the_first_keyframe_counts_as_known():
    walked = straight(6)
    bound = RelativeUncertainty().upper_bound(5, exact_path(walked.way), walked.poses)
    answer = seen_from(walked.energy(5), walked.poses)
    np.testing.assert_allclose(bound.angle[:5], answer.angle[:5], rtol=1e-6)
    assert (bound.distance[:5] >= (1 - 1e-6) * answer.distance[:5]).all()
