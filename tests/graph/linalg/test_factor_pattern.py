"""Where the factor has blocks, against dense symbolic elimination."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.linalg.factor_pattern import block_targets, find_pattern


@st.composite
def edges(draw: st.DrawFn) -> tuple[int, list[tuple[int, int]]]:
    """A number of nodes, and edges among them: any way round, again and again, of a node to itself, to −1."""
    nodes = draw(st.integers(1, 9))
    node = st.integers(-1, nodes - 1)
    return nodes, draw(st.lists(st.tuples(node, node), max_size=25))


@given(edges())
@settings(max_examples=200, deadline=None)
def test_the_pattern_is_that_of_the_elimination(drawn):
    nodes, pairs = drawn
    named = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    pattern = find_pattern(named, nodes)
    assert sorted(pattern.place.tolist()) == list(range(nodes))
    there = np.eye(nodes, dtype=bool)
    for a, b in pairs:
        if a >= 0 and b >= 0:
            row, column = pattern.place[a], pattern.place[b]
            there[row, column] = there[column, row] = True
    for k in range(nodes):
        below = np.flatnonzero(there[:, k] & (np.arange(nodes) > k))
        there[np.ix_(below, below)] = True
    for k in range(nodes):
        rows = pattern.rows[pattern.starts[k] : pattern.starts[k + 1]]
        np.testing.assert_array_equal(rows, np.flatnonzero(there[:, k] & (np.arange(nodes) >= k)))
    assert pattern.supernodes[0] == 0
    assert pattern.supernodes[-1] == nodes
    for n, (first, end) in enumerate(itertools.pairwise(pattern.supernodes.tolist())):
        assert end > first
        block = there[:, first:end] & (np.arange(nodes)[:, None] >= first)
        height = np.count_nonzero(block[:, 0])
        assert pattern.panels[n + 1] - pattern.panels[n] == 9 * (end - first) * height
        for column in range(first, end):
            # One row of blocks less each time: a dense triangle, and the same rows below it.
            rows = np.flatnonzero(there[:, column] & (np.arange(nodes) >= column))
            np.testing.assert_array_equal(rows, np.flatnonzero(block[:, 0])[column - first :])
    for (a, b), target in zip(pairs, block_targets(named, pattern).tolist(), strict=True):
        assert (target == -1) == (a < 0 or b < 0)
        if target >= 0:
            row, column = sorted((pattern.place[a], pattern.place[b]), reverse=True)
            assert pattern.rows[target >> 1] == row
            assert pattern.starts[column] <= target >> 1 < pattern.starts[column + 1]


@given(st.lists(st.integers(0, 10**6), max_size=40))
@settings(max_examples=60, deadline=None)
def test_a_tree_fills_nothing(parents: list[int]):
    """Its leaves are eliminated before their parents, so the factor has the blocks of the matrix alone."""
    branches = [(k + 1, parent % (k + 1)) for k, parent in enumerate(parents)]
    nodes = len(parents) + 1
    pattern = find_pattern(np.array(branches, dtype=np.int64).reshape(-1, 2), nodes)
    assert len(pattern.rows) == 2 * nodes - 1


def test_a_ring_fills_one_block_for_each_node_but_three():
    pattern = find_pattern(np.array([(k, (k + 1) % 9) for k in range(9)]), 9)
    assert len(pattern.rows) == 9 + 9 + 6
