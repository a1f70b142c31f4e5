"""The bound by the surest way: never too little, and exact where there is only one way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import Pairwise
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Array
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.loop_closure.most_certain_paths import LinkCache, most_certain_paths
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from tests.slam.keyframe_drives import exact_path
from tests.slam.keyframe_walks import Walk, seen_from, straight, walk

LEVER_ARM = LoopClosureOptions.lever_arm


def bound(walked: Walk, origin: int) -> Array:
    """The covariances (K, 3, 3) along the surest ways."""
    size = len(walked.poses)
    route = Route([], np.arange(size), walked.way, np.zeros(size), walked.poses)
    links = LinkCache().links(route, exact_path(walked.way), [*walked.loops, *walked.nscan])
    return most_certain_paths(links, walked.poses, origin, LEVER_ARM)[0]


@given(st.integers(0, 10**6), st.integers(3, 9), st.integers(0, 6), st.data())
@settings(max_examples=100, deadline=None)
def test_it_is_never_too_little(seed, size, loops, data):
    walked = walk(seed, size, loops)
    origin = data.draw(st.integers(0, size - 1))
    found, answer = bound(walked, origin), seen_from(walked.energy(origin), walked.poses)
    distance = np.sqrt(np.linalg.eigvalsh(found[:, :2, :2])[:, 1])
    assert (distance >= (1 - 1e-6) * answer.distance).all()
    assert (np.sqrt(found[:, 2, 2]) >= (1 - 1e-6) * answer.angle).all()


@pytest.mark.parametrize("origin", [0, 3, 7])
def test_along_the_only_way_it_is_the_answer_itself(origin):
    walked = walk(11, 8, loops=0)
    found, answer = bound(walked, origin), seen_from(walked.energy(origin), walked.poses)
    np.testing.assert_allclose(np.sqrt(found[:, 2, 2]), answer.angle, rtol=1e-6)
    distance = np.sqrt(np.linalg.eigvalsh(found[:, :2, :2])[:, 1])
    np.testing.assert_allclose(distance, answer.distance, rtol=1e-6, atol=1e-12)


def test_a_loop_is_a_shorter_way():
    """Golden: five steps of 0.1 rad from keyframe 0 to 5; by the loop at most 2 · 0.01 to 11, then back."""
    open_way = straight(12)
    sure = np.diag([1e4, 1e4, 1e4])
    loop = Pairwise((0, 11), np.array([22.0, 0, 0]), sure, "loop")
    angles = np.sqrt(bound(open_way._replace(loops=[loop]), 0)[:, 2, 2])
    np.testing.assert_allclose(angles[:6], 0.1 * np.sqrt(np.arange(6)), rtol=1e-9)
    back = np.arange(5)
    np.testing.assert_allclose(angles[11 - back], np.sqrt(0.02**2 + 0.01 * back), rtol=1e-9)


def test_what_no_relation_leads_to_is_nowhere():
    walked = straight(4)
    route = Route([], np.arange(5), walked.way, np.zeros(5), np.zeros((5, 3)))
    links = LinkCache().links(route, exact_path(walked.way), [])
    found, before = most_certain_paths(links, np.zeros((5, 3)), 0, LEVER_ARM)
    np.testing.assert_array_equal(before, [-1, 0, 1, 2, -1])
    assert np.isfinite(found[:4]).all()
    assert np.isinf(found[4]).all()


def test_a_loop_that_says_nothing_is_no_way():
    open_way = straight(12)
    loop = Pairwise((0, 11), np.array([22.0, 0, 0]), np.zeros((3, 3)), "loop")
    np.testing.assert_allclose(bound(open_way._replace(loops=[loop]), 0), bound(open_way, 0))


def test_directions_that_a_loop_does_not_hold_are_no_way():
    """Along a corridor: σ of 1 mm across it and nothing along."""
    open_way = straight(12)
    loop = Pairwise((0, 11), np.array([22.0, 0, 0]), np.diag([0.0, 1e6, 1e6]), "loop")
    found = bound(open_way._replace(loops=[loop]), 0)
    np.testing.assert_allclose(found, bound(open_way, 0))


def test_links_that_are_kept_are_those_that_are_made_anew():
    """While loops join, and after one has gone."""
    walked = walk(7, 9, loops=4)
    size, way = len(walked.poses), exact_path(walked.way)
    route = Route([], np.arange(size), walked.way, np.zeros(size), walked.poses)
    loops: list[Relation] = [*walked.nscan, *walked.loops]
    kept = LinkCache()
    for chosen in (loops[:2], loops[:2], loops[:5], loops, loops[1:], loops[:1], []):
        anew = LinkCache().links(route, way, chosen)
        for one, other in zip(kept.links(route, way, chosen), anew, strict=True):
            np.testing.assert_array_equal(one, other)
