from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.relation_terms import nscan_term
from nscan_cli.poses import Array, compose, inverse, relative, rotated_information
from tests.graph.reference_terms import derivative, nscan_error, pairwise_error, second_derivative, term
from tests.graph.small_graph import matrices

# Near ±π, where angles jump, as often as anywhere else.
angles = st.floats(-4, 4) | st.floats(-1e-6, 1e-6).map(lambda e: np.pi + e) | st.just(-np.pi)
lengths = st.floats(-20, 20)
poses = st.tuples(lengths, lengths, angles)


@st.composite
def pairs(draw: st.DrawFn) -> tuple[Array, Pairwise]:
    x = np.array([draw(poses), draw(poses)])
    relation = Pairwise((0, 1), np.array(draw(poses)), draw(matrices(3)), "track")
    assume(np.pi - abs(pairwise_error(x, relation)[2]) > 1e-4)
    return x, relation


@st.composite
def joints(draw: st.DrawFn, n: int | None = None) -> tuple[Array, NScan]:
    n = n or draw(st.integers(2, 5))
    x, local = (np.array([draw(poses) for _ in range(n)]) for _ in range(2))
    relation = NScan(tuple(range(n)), local, draw(matrices(3 * n)), draw(st.integers(0, n - 1)), "nscan")
    assume((np.pi - np.abs(nscan_error(x, relation)[2::3]) > 1e-4).all())
    return x, relation


def evaluate(x: Array, relation: Pairwise | NScan, curvature: float = 1.0) -> tuple[float, Array, Array]:
    # Filled, because a kernel has to write every entry.
    gradient, hessian = np.full(x.size, np.nan), np.full((x.size, x.size), np.nan)
    value = nscan_term(x, *relation.term()[:3], curvature, gradient, hessian)
    return value, gradient, hessian


def error_and_weight(relation: Pairwise | NScan) -> tuple[Callable[[Any], Any], Array]:
    """What the term squares, and how it weighs that."""
    if isinstance(relation, NScan):
        return (lambda y: nscan_error(y, relation)), relation.hessian
    return (lambda y: pairwise_error(y, relation)), relation.information


@settings(max_examples=60, deadline=None)
@given(pairs() | joints())
def test_value_gradient_and_hessian_are_those_of_the_paper(case: tuple[Array, Pairwise | NScan]):
    x, relation = case
    value, gradient, hessian = evaluate(x, relation)

    def f(y: Any) -> Any:
        return term(y, relation)

    # What cancels in the sums is as large as the largest entries.
    error, weight = error_and_weight(relation)
    # Coordinates of some metres leave rounding in e even where it is 0.
    e, J = np.abs(error(x)) + 0.01, np.abs(derivative(error, x))
    np.testing.assert_allclose(value, f(x), rtol=1e-9, atol=1e-13 * (e @ np.abs(weight) @ e))
    expected = derivative(f, x)
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-12 * (e @ np.abs(weight) @ J).max())
    scale = (J.T @ np.abs(weight) @ J).max() + (e @ np.abs(weight) @ J).max()
    # Central differences leave out h² / 6 times the fourth derivative: 7e-11 of an angle's entry, and thrice
    # that of products of the second ones of e, which are as long as a column of J, in any direction.
    curved = np.abs(weight).max() * (J**2).sum(axis=0).max()
    atol = 1e-9 * scale + 1e-10 * (np.abs(hessian).max() + curved)
    np.testing.assert_allclose(hessian, second_derivative(f, x), rtol=0, atol=atol)
    np.testing.assert_allclose(hessian, hessian.T, rtol=0, atol=1e-13 * scale)


@settings(max_examples=60, deadline=None)
@given(pairs() | joints())
def test_the_gauss_newton_part_is_that_of_the_error_and_semi_definite(case: tuple[Array, Pairwise | NScan]):
    x, relation = case
    error, weight = error_and_weight(relation)
    _, gradient, hessian = evaluate(x, relation, curvature=0.0)
    J = derivative(error, x)
    scale = (np.abs(J).T @ np.abs(weight) @ np.abs(J)).max()
    np.testing.assert_allclose(hessian, 2 * J.T @ weight @ J, rtol=0, atol=1e-12 * scale)
    assert np.linalg.eigvalsh(hessian)[0] >= -1e-12 * scale
    np.testing.assert_array_equal(gradient, evaluate(x, relation)[1])


def test_the_gradient_of_a_turn_of_30_degrees_by_hand():
    # b was measured 2 m ahead of a and is there, but a looks 30° off: Δ = (2 cos 30° − 2, −2 sin 30°, −π/6).
    x = np.array([[0.0, 0.0, np.pi / 6], [2.0, 0.0, np.pi / 6]])
    relation = Pairwise((0, 1), np.array([2.0, 0.0, np.pi / 6]), np.diag([1.0, 10.0, 100.0]), "track")
    value, gradient, _ = evaluate(x, relation)
    dx, dy, turn = np.sqrt(3) - 2, -1.0, -np.pi / 6
    np.testing.assert_allclose(value, dx**2 + 10 * dy**2 + 100 * turn**2)
    np.testing.assert_allclose(gradient[5], 200 * turn)
    # ∂u/∂φ_a = (u_y, −u_x, −1)
    np.testing.assert_allclose(gradient[2], 2 * (dx * -1.0 + 10 * dy * -np.sqrt(3) - 100 * turn))


@settings(max_examples=60, deadline=None)
@given(joints(n=2))
def test_two_scans_are_a_pairwise_relation(case: tuple[Array, NScan]):
    x, relation = case
    c, o = relation.fixed, 1 - relation.fixed
    own = relation.hessian[3 * o : 3 * o + 3, 3 * o : 3 * o + 3]
    pair = Pairwise(
        (c, o),
        relative(relation.poses[o], relation.poses[c]),
        rotated_information(inverse(relation.poses[c]), own),
        "nscan",
    )
    joint, single = evaluate(x, relation), evaluate(x[[c, o]], pair)
    order = np.concatenate([np.arange(3) + 3 * c, np.arange(3) + 3 * o])
    np.testing.assert_allclose(joint[0], single[0], rtol=1e-9, atol=1e-12 * np.abs(own).max())
    scale = 1e-9 * (np.abs(joint[2]).max() + np.abs(joint[1]).max())
    np.testing.assert_allclose(joint[1][order], single[1], rtol=0, atol=scale)
    np.testing.assert_allclose(joint[2][np.ix_(order, order)], single[2], rtol=0, atol=scale)


@settings(max_examples=60, deadline=None)
@given(pairs() | joints(), poses)
def test_a_motion_of_all_poses_changes_nothing(
    case: tuple[Array, Pairwise | NScan], motion: tuple[float, float, float]
):
    x, relation = case
    value, gradient, _ = evaluate(x, relation)
    moved_value, moved_gradient, _ = evaluate(compose(np.array(motion), x), relation)
    scale = np.abs(gradient).max() + value + np.abs(error_and_weight(relation)[1]).max()
    np.testing.assert_allclose(moved_value, value, rtol=1e-7, atol=1e-10 * scale)
    c, s = np.cos(motion[2]), np.sin(motion[2])
    turned = gradient.reshape(-1, 3) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(moved_gradient.reshape(-1, 3), turned, rtol=0, atol=1e-9 * scale)


@settings(max_examples=60, deadline=None)
@given(joints(), poses)
def test_moved_local_poses_have_no_energy(case: tuple[Array, NScan], motion: tuple[float, float, float]):
    relation = case[1]
    value, gradient, _ = evaluate(compose(np.array(motion), relation.poses), relation)
    scale = np.abs(relation.hessian).max()
    assert abs(value) <= 1e-20 * scale
    assert np.abs(gradient).max() <= 1e-9 * scale
