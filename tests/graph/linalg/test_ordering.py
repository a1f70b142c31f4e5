"""The order of little fill against elimination of a dense matrix, node by node, and against SuperLU's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from nscan_cli.graph.linalg.ordering import order_of_little_fill

Touching = NDArray[np.bool_]


def touching(nodes: int, edges: list[tuple[int, int]]) -> Touching:
    """(F, F) which nodes touch; each touches itself."""
    there = np.eye(nodes, dtype=np.bool_)
    for a, b in edges:
        there[a, b] = there[b, a] = True
    return there


def order_of(there: Touching) -> NDArray[np.int64]:
    indices = np.concatenate([np.flatnonzero(row) for row in there])
    return order_of_little_fill(np.concatenate([[0], np.cumsum(there.sum(axis=1))]), indices)


def fill_of(there: Touching, place: NDArray[np.int64]) -> int:
    """How many entries the factor has, when the nodes are eliminated in this order."""
    rows = np.argsort(place)
    left, entries = there[np.ix_(rows, rows)], 0
    for k in range(len(left)):
        below = k + np.flatnonzero(left[k:, k])
        left[np.ix_(below, below)] = True
        entries += len(below)
    return entries


def fill_of_superlu(there: Touching) -> int:
    """As many entries as SuperLU's minimum degree gives."""
    matrix = csc_array(np.where(there, -1.0, 0.0) + len(there) * np.eye(len(there)))
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return fill_of(there, factor.perm_c.astype(np.int64))


@st.composite
def sparse(draw: st.DrawFn) -> Touching:
    nodes = draw(st.integers(1, 14))
    node = st.integers(0, nodes - 1)
    return touching(nodes, draw(st.lists(st.tuples(node, node), max_size=3 * nodes)))


@given(sparse())
@settings(max_examples=200, deadline=None)
def test_every_node_has_its_row(there: Touching):
    assert sorted(order_of(there).tolist()) == list(range(len(there)))


@given(st.lists(st.integers(0, 10**6), max_size=40))
@settings(max_examples=60, deadline=None)
def test_a_tree_fills_nothing(parents: list[int]):
    """Its leaves come before what they hang on: no node ever joins two others that are left."""
    there = touching(len(parents) + 1, [(k + 1, parent % (k + 1)) for k, parent in enumerate(parents)])
    assert fill_of(there, order_of(there)) == 2 * len(there) - 1


def test_each_node_has_the_least_degree_where_none_are_alike():
    """Golden: of a star of paths, from their ends; a ring of five last, which fills two entries."""
    ring = [(k, (k + 1) % 5) for k in range(5)]
    place = order_of(touching(8, [*ring, (0, 5), (5, 6), (6, 7)]))
    assert place[[7, 6, 5]].tolist() == [0, 1, 2]
    assert fill_of(touching(8, [*ring, (0, 5), (5, 6), (6, 7)]), place) == 8 + 8 + 2


def test_nodes_that_touch_the_same_are_eliminated_together():
    """Three of a clique that hang on two nodes of another one, which touch a third clique."""
    alike = [(a, b) for a in (0, 4, 7) for b in (0, 4, 7, 1, 2) if a != b]
    rest = [(1, 2), (1, 3), (2, 3), (1, 5), (2, 5), (3, 5), (3, 6), (5, 6)]
    there = touching(8, [*alike, *rest])
    place = order_of(there)
    rows = sorted(place[[0, 4, 7]].tolist())
    assert rows == list(range(rows[0], rows[0] + 3))
    assert fill_of(there, place) == there.sum() // 2 + 4


@pytest.mark.parametrize("seed", range(4))
def test_fills_no_more_than_superlus_minimum_degree(seed: int):
    """Passes through the same places, as a robot's: each keyframe touches those near it."""
    rng = np.random.default_rng(seed)
    way = np.cumsum(rng.normal(size=(400, 2)), axis=0)
    apart = np.linalg.norm(way[:, None] - way, axis=2)
    there = apart < 1.5
    assert fill_of(there, order_of(there)) <= 1.1 * fill_of_superlu(there)
