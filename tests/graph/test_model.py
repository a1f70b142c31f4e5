from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import Graph
from nscan_cli.poses import relative, wrap
from tests.graph.small_graph import graphs, poses, small_graph


@settings(max_examples=50, deadline=None)
@given(graphs(), st.lists(poses, min_size=6, max_size=6), st.booleans())
def test_attached_nodes_stay_rigid_with_their_keyframe(
    graph: Graph, targets: list[tuple[float, float, float]], all_of_them: bool
):
    before = graph.poses.copy()
    moved = graph.keyframes if all_of_them else graph.keyframes[:1]
    graph.move_keyframes(moved, np.array(targets)[: len(moved)])
    np.testing.assert_array_equal(graph.poses[moved], np.array(targets)[: len(moved)])
    unmoved = np.setdiff1d(graph.keyframes, moved)
    np.testing.assert_array_equal(graph.poses[unmoved], before[unmoved])
    gap = relative(graph.poses, graph.poses[graph.anchors]) - relative(before, before[graph.anchors])
    gap[:, 2] = wrap(gap[:, 2])
    np.testing.assert_allclose(gap, 0, atol=1e-8)


def test_a_keyframe_that_turns_left_carries_what_is_ahead_of_it_to_its_left():
    graph = small_graph()
    graph.poses = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.5], [9.0, 9.0, 0.0]])
    graph.move_keyframes(np.array([0]), np.array([[1.0, 1.0, np.pi / 2]]))
    expected = [[1.0, 1.0, np.pi / 2], [1.0, 3.0, np.pi / 2 + 0.5], [9.0, 9.0, 0.0]]
    np.testing.assert_allclose(graph.poses, expected, atol=1e-12)
