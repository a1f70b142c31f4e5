from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.linalg.block_cholesky import Factor, factorise, solve, undetermined_nodes
from nscan_cli.graph.linalg.factor_pattern import block_targets, find_pattern
from nscan_cli.graph.linalg.selected_inverse import inverse_diagonal
from nscan_cli.poses import Array


def factor_of(matrix: Array, edges: list[tuple[int, int]]) -> Factor:
    """The factor of a dense matrix (3 F, 3 F) that has blocks at the edges and on the diagonal alone."""
    nodes = len(matrix) // 3
    entries = np.array(edges + [(i, i) for i in range(nodes)], dtype=np.int64).reshape(-1, 2)
    pattern = find_pattern(entries, nodes)
    blocks = np.zeros((len(pattern.rows), 3, 3))
    for (a, b), target in zip(entries, block_targets(entries, pattern), strict=True):
        block = matrix[3 * a : 3 * a + 3, 3 * b : 3 * b + 3]
        blocks[target >> 1] = block.T if target & 1 else block
    return factorise(pattern, blocks)


def random_matrix(nodes: int, edges: list[tuple[int, int]], rng: np.random.Generator) -> Array:
    """Positive definite: what each edge holds between two nodes, and something for each node."""
    matrix = np.zeros((3 * nodes, 3 * nodes))
    for a, b in edges:
        J = np.zeros((3, 3 * nodes))
        J[:, 3 * a : 3 * a + 3], J[:, 3 * b : 3 * b + 3] = rng.normal(size=(2, 3, 3))
        matrix += J.T @ J
    return matrix + 0.1 * np.eye(3 * nodes)


@st.composite
def sparse(draw: st.DrawFn) -> tuple[Array, list[tuple[int, int]]]:
    nodes = draw(st.integers(1, 12))
    node = st.integers(0, nodes - 1)
    edges = draw(st.lists(st.tuples(node, node).filter(lambda e: e[0] != e[1]), max_size=3 * nodes))
    return random_matrix(nodes, edges, np.random.default_rng(draw(st.integers(0, 2**32 - 1)))), edges


@settings(max_examples=60, deadline=None)
@given(sparse())
def test_solves_and_inverts_like_a_dense_matrix(case: tuple[Array, list[tuple[int, int]]]):
    matrix, edges = case
    nodes = len(matrix) // 3
    factor = factor_of(matrix, edges)
    assert not factor.loose.any()
    right = np.random.default_rng(0).normal(size=(nodes, 3))
    np.testing.assert_allclose(
        solve(factor, right).ravel(), np.linalg.solve(matrix, right.ravel()), rtol=1e-9
    )
    inverse = np.linalg.inv(matrix).reshape(nodes, 3, nodes, 3)[np.arange(nodes), :, np.arange(nodes)]
    np.testing.assert_allclose(inverse_diagonal(factor), inverse, rtol=1e-9, atol=1e-12)


def test_panels_of_any_width_and_height():
    """Rooms of 1 to 30 nodes that all see each other, along a corridor, and the corridor twice."""
    rng = np.random.default_rng(7)
    sizes = [1, 2, 3, 5, 8, 13, 30, 4]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    edges = [(a, b) for s, e in itertools.pairwise(starts.tolist()) for a in range(s, e) for b in range(s, a)]
    edges += [(int(a), int(b)) for a, b in itertools.pairwise(starts[:-1])]
    edges += [(int(e) - 1, int(s)) for s, e in zip(starts[:-3], starts[3:], strict=True)]
    matrix = random_matrix(int(starts[-1]), edges, rng)
    factor, right = factor_of(matrix, edges), rng.normal(size=(int(starts[-1]), 3))
    assert np.diff(factor.pattern.supernodes).max() > 20
    np.testing.assert_allclose(
        solve(factor, right).ravel(), np.linalg.solve(matrix, right.ravel()), rtol=1e-8
    )
    dense = np.linalg.inv(matrix).reshape(len(right), 3, len(right), 3)
    inverse = dense[np.arange(len(right)), :, np.arange(len(right))]
    np.testing.assert_allclose(inverse_diagonal(factor), inverse, rtol=1e-8, atol=1e-12)


def test_a_long_ring_fills_little():
    nodes = 500
    pattern = find_pattern(np.array([(i, (i + 1) % nodes) for i in range(nodes)]), nodes)
    # A column of a ring has two blocks below its diagonal at the most, in any good order.
    assert len(pattern.rows) <= 3 * nodes
    assert sorted(pattern.place) == list(range(nodes))


def test_no_nodes_at_all():
    factor = factor_of(np.empty((0, 0)), [])
    assert solve(factor, np.empty((0, 3))).shape == (0, 3)
    assert inverse_diagonal(factor).shape == (0, 3, 3)


@pytest.mark.parametrize("share", [0.0, -1e-3, -1.0])
def test_a_matrix_that_is_not_positive_definite_is_noticed(share: float):
    rng = np.random.default_rng(4)
    edges = [(0, 1), (1, 2), (2, 3), (0, 3)]
    eigenvalues, vectors = np.linalg.eigh(random_matrix(4, edges, rng))
    dense = [(a, b) for a in range(4) for b in range(a)]
    eigenvalues[0] = share * eigenvalues[-1]
    assert factor_of((vectors * eigenvalues) @ vectors.T, dense).loose.any()


def test_nan_is_noticed():
    matrix = np.eye(6)
    matrix[3, 3] = np.nan
    assert factor_of(matrix, []).loose.any()


def test_nodes_of_a_loose_direction_are_named_and_the_others_keep_their_inverse():
    # 0 is held; 1 and 2 hold each other but may slide together along x; 3 hangs on 0.
    matrix = np.eye(12)
    slide = np.zeros(12)
    slide[3], slide[6] = 1.0, -1.0
    matrix[[3, 6], [3, 6]] = 0.0
    matrix += np.outer(slide, slide)
    link = np.zeros((3, 12))
    link[:, 0:3], link[:, 9:12] = -np.eye(3), np.eye(3)
    matrix += link.T @ link
    factor = factor_of(matrix, [(1, 2), (0, 3)])
    assert factor.loose.sum() == 1
    assert undetermined_nodes(factor).tolist() == [False, True, True, False]
    blocks = inverse_diagonal(factor)
    held = np.linalg.inv(matrix[np.ix_([0, 9], [0, 9])])
    np.testing.assert_allclose(blocks[0], held[0, 0] * np.eye(3))
    np.testing.assert_allclose(blocks[3], held[1, 1] * np.eye(3))
    assert np.isfinite(blocks).all()
