"""When a graph that grows is optimised, and how much of it."""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.model import Pairwise
from nscan_cli.slam.backend.options import ScheduleOptions
from nscan_cli.slam.backend.schedule import OptimisationSchedule
from nscan_cli.slam.backend.subgraph import Subgraph
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.options import SlamOptions
from tests.simulation.building import growing
from tests.slam.mapped_logs import mapped

OPTIONS = ScheduleOptions(min_motion=0.1, min_new_share=0.1, max_keyframes=20, whole_new_share=0.5)


def chain(size: int) -> tuple[Route, list[Pairwise]]:
    """Keyframes 1 m apart on a line."""
    poses = np.zeros((size, 3))
    poses[:, 0] = np.arange(size)
    relations = [Pairwise((k, k + 1), np.array([1.0, 0, 0]), np.eye(3), "track") for k in range(size - 1)]
    return Route([], np.arange(size), relations, poses[:, 0], poses), relations


def test_it_is_due_when_scans_have_moved_and_a_share_is_new():
    growth = OptimisationSchedule(OPTIONS)
    growth.optimised(90, Subgraph([]))
    growth.matched(0.06)
    assert not growth.is_due(100)
    growth.matched(0.05)
    assert not growth.is_due(99)
    assert growth.is_due(100)
    growth.optimised(100, Subgraph([]))
    assert not growth.is_due(200)


def test_a_small_graph_is_due_as_a_whole():
    growth = OptimisationSchedule(OPTIONS)
    growth.optimised(19, Subgraph([]))
    route, relations = chain(20)
    part = growth.due(route, relations)
    assert part.relations is relations
    assert part.free is None


def test_of_a_large_one_what_is_near_the_new_keyframes_and_now_and_then_all():
    growth, few = OptimisationSchedule(OPTIONS), np.ones(1, dtype=np.bool_)
    growth.optimised(40, Subgraph([]))
    for size in (45, 60, 79):
        part = growth.due(*chain(size))
        assert part.free is not None
        np.testing.assert_array_equal(np.flatnonzero(part.free), np.arange(size - 20, size))
        assert [relation.nodes[0] for relation in part.relations] == [*range(size - 21, size - 1)]
        growth.optimised(size, Subgraph([], few))
    assert growth.due(*chain(80)).free is None


def test_solved_in_parts_the_map_is_the_same():
    """Along two rows of a building and the loops between them, with parts of 20 of 390 keyframes."""
    log = growing(6_250).log()
    whole = mapped(log)
    parts = SlamOptions(
        loop_closure=LoopClosureOptions(max_exact_keyframes=20), schedule=ScheduleOptions(max_keyframes=20)
    )
    assert len(whole.state.poses) < SlamOptions().schedule.max_keyframes
    found = mapped(log, parts)
    assert [(loop.nodes, loop.accepted) for loop in found.graph.loops] == [
        (loop.nodes, loop.accepted) for loop in whole.graph.loops
    ]
    assert np.abs(found.graph.poses - whole.graph.poses).max() < 1e-3
