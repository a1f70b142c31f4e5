"""Parts of a large graph: what is chosen, and that what is left out is never taken for knowledge."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import StopOptions, optimise_poses
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Mask
from nscan_cli.slam.backend.energy_cache import EnergyCache
from nscan_cli.slam.backend.subgraph import (
    Subgraph,
    held_by_others,
    nearest_keyframes,
    without_others,
)
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.loop_closure.most_certain_paths import LinkCache, most_certain_paths, relations_on_paths
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.relative_uncertainty import (
    RelativeSigma,
    RelativeUncertainty,
    held_pose_marginals,
)
from tests.slam.keyframe_drives import exact_path
from tests.slam.keyframe_walks import Walk, straight, walk

APART = 7
"""Scans of the log from one keyframe to the next: ids of nodes are none of places."""


class Walked(NamedTuple):
    """The keyframes of a walk, and their relations by rows of a log."""

    route: Route
    way: list[Relation]
    loops: list[Relation]

    def energy(self, part: Subgraph, fixed: int) -> GraphEnergy:
        return EnergyCache(APART * len(self.route.rows)).of(self.route, part.relations, fixed, part.free)

    def whole(self) -> Subgraph:
        return Subgraph([*self.way, *self.loops])

    def led_to(self, origin: int, wanted: Mask) -> Mask:
        """Those wanted, and what is on the surest ways to them."""
        way = exact_path([relation for relation in self.way if isinstance(relation, Pairwise)])
        links = LinkCache().links(self.route, way, self.loops)
        return relations_on_paths(
            most_certain_paths(links, self.route.poses, origin, LoopClosureOptions.lever_arm)[1], wanted
        )


def walked(seed: int, size: int, loops: int) -> Walked:
    return of(walk(seed, size, loops))


def of(drive: Walk) -> Walked:
    size = len(drive.poses)
    way: list[Relation] = [spread(each) for each in drive.way]
    loops: list[Relation] = [*map(spread, drive.loops), *map(spread, drive.nscan)]
    return Walked(Route([], APART * np.arange(size), [], np.zeros(size), drive.poses), way, loops)


def spread(relation: Pairwise | NScan) -> Relation:
    """With rows of the log for places."""
    if isinstance(relation, NScan):
        return dataclasses.replace(relation, nodes=tuple(APART * node for node in relation.nodes))
    first, last = relation.nodes
    return dataclasses.replace(relation, nodes=(APART * first, APART * last))


def chosen(size: int, *places: int) -> Mask:
    return np.isin(np.arange(size), places)


@given(st.integers(0, 10**6), st.integers(1, 30), st.integers(1, 40), st.data())
@settings(max_examples=50, deadline=None)
def test_the_nearest_are_nearer_than_all_others(seed, size, most, data):
    poses = np.random.default_rng(seed).uniform(-10, 10, (size, 3))
    first = data.draw(st.integers(0, size - 1))
    end = data.draw(st.integers(first + 1, size))
    found = nearest_keyframes(poses, first, end, most)
    away = np.linalg.norm(poses[:, None, :2] - poses[None, first:end, :2], axis=2).min(axis=1)
    assert found.sum() == min(most, size)
    assert away[found].max() <= away[~found].min(initial=np.inf)


@pytest.mark.parametrize("places", [(3, 4, 5), (0, 1, 11), (2, 9)])
def test_what_can_move_finds_its_minimum_and_the_others_stay(places):
    """The whole energy has no gradient there by the poses that can move; the first one never can."""
    graph = walked(3, 12, loops=4)
    part = held_by_others(graph.route, [*graph.way, *graph.loops], chosen(12, *places))
    assert all({node // APART for node in relation.nodes} & {*places} for relation in part.relations)
    start = graph.route.poses + np.random.default_rng(1).normal(0, 0.05, (12, 3))
    found = optimise_poses(graph.energy(part, 0), start, StopOptions(tolerance=1e-9))
    moved = [place for place in places if place]
    others = np.delete(np.arange(12), moved)
    np.testing.assert_array_equal(found.poses[others], start[others])
    whole = graph.energy(graph.whole(), 0)
    gradient = np.zeros((12, 3))
    gradient[whole.free] = whole.evaluate(found.poses, exact=False).gradient
    before = np.zeros((12, 3))
    before[whole.free] = whole.evaluate(start, exact=False).gradient
    assert np.abs(gradient[moved]).max() < 1e-6 * np.abs(before[moved]).max()
    assert whole.terms(found.poses).sum() < whole.terms(start).sum()


@given(st.integers(0, 10**6), st.integers(4, 12), st.integers(0, 6), st.data())
@settings(max_examples=100, deadline=None)
def test_without_the_others_it_is_never_too_little(seed, size, loops, data):
    """Of those that are wanted and on the way to them; and all of them are known."""
    graph = walked(seed, size, loops)
    origin = data.draw(st.integers(0, size - 1))
    wanted = chosen(size, *data.draw(st.lists(st.integers(0, size - 1), min_size=1)))
    led_to = graph.led_to(origin, wanted)
    assert (led_to >= wanted).all()
    part = without_others(graph.route, graph.way, graph.loops, led_to)
    found = held_pose_marginals(graph.energy(part, origin), graph.route.poses).sigma()
    answer = held_pose_marginals(graph.energy(graph.whole(), origin), graph.route.poses).sigma()
    assert np.isfinite(found.distance[led_to]).all()
    assert (found.distance >= (1 - 1e-6) * answer.distance).all()
    assert (found.angle >= (1 - 1e-6) * answer.angle).all()
    assert part.free is not None
    assert (np.isfinite(found.angle) <= (part.free | chosen(size, origin))).all()


def test_with_all_keyframes_it_is_the_answer_itself():
    graph = walked(5, 10, loops=3)
    part = without_others(graph.route, graph.way, graph.loops, np.ones(10, dtype=np.bool_))
    asked, answer = (
        held_pose_marginals(graph.energy(each, 4), graph.route.poses).covariances
        for each in (part, graph.whole())
    )
    np.testing.assert_array_equal(asked, answer)


def test_from_another_keyframe_the_part_is_seen_and_no_more():
    graph = walked(6, 12, loops=3)
    led_to = graph.led_to(11, chosen(12, 8, 9))
    part = without_others(graph.route, graph.way, graph.loops, led_to)
    asked = held_pose_marginals(graph.energy(part, 11), graph.route.poses)
    direct = held_pose_marginals(graph.energy(part, 9), graph.route.poses).sigma()
    for found, expected in zip(asked.seen_from(9), direct, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-12)
    assert part.free is not None
    assert np.isinf(direct.distance).sum() == 12 - (part.free | chosen(12, 11)).sum() > 0


def test_what_was_not_asked_keeps_its_bound():
    drive = straight(12)
    graph, uncertainty = of(drive), RelativeUncertainty()
    bound = uncertainty.upper_bound(11, exact_path(drive.way), drive.poses)
    part = without_others(graph.route, graph.way, [], chosen(12, 8, 9, 10, 11))
    asked = uncertainty.compute(graph.energy(part, 11), drive.poses)
    answer = held_pose_marginals(graph.energy(graph.whole(), 11), drive.poses).sigma()
    for found, before, expected in zip(asked, bound, answer, strict=True):
        np.testing.assert_array_equal(found[:8], before[:8])
        np.testing.assert_allclose(found[8:], expected[8:], rtol=1e-8, atol=1e-12)


def test_a_keyframe_that_nothing_holds_in_a_direction_is_not_known():
    """A loop along a corridor leads to it, and nothing else of the part."""
    drive = straight(12)
    loop = Pairwise((0, 11), np.array([22.0, 0, 0]), np.diag([0.0, 1e6, 1e6]), "loop")
    graph = of(drive._replace(loops=[loop]))
    part = without_others(graph.route, graph.way, graph.loops, chosen(12, 9, 10, 11))
    assert part.free is not None
    assert part.free[0]
    found: RelativeSigma = held_pose_marginals(graph.energy(part, 10), drive.poses).sigma()
    np.testing.assert_array_equal(np.isfinite(found.distance), chosen(12, 9, 10, 11))


def test_the_ways_are_those_to_what_is_wanted():
    """Golden: from 3, to 1 by 2, to 6 by 4 and 5; nothing leads to 7."""
    before = np.array([1, 2, 3, -1, 3, 4, 5, -1])
    np.testing.assert_array_equal(relations_on_paths(before, chosen(8, 1, 6)), chosen(8, 1, 2, 3, 4, 5, 6))
    np.testing.assert_array_equal(relations_on_paths(before, chosen(8, 3)), chosen(8, 3))
    np.testing.assert_array_equal(relations_on_paths(before, chosen(8, 7, 4)), chosen(8, 3, 4, 7))
