"""Scans that are connected by overlap: from all overlaps, or from those that are needed."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.overlap import connected_at, connectivity, overlaps, weakest_link
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.pairwise import scan_ndt
from tests.matching.problems import OPTIONS, Problem, office_problem

BOUND = JointOptions.inlier_bound


@functools.cache
def five() -> Problem:
    """Some are connected, others are not."""
    return office_problem((2000, 2008, 2040, 2100, 2180))


@given(st.integers(0, 10**6), st.floats(0.0, 1.0), st.integers(0, 4))
@settings(max_examples=60, deadline=None)
def test_connected_scans_are_a_component_of_the_overlaps(seed, least, scan):
    """An independent formula: the component of a scan in the graph of the greater overlaps."""
    rng = np.random.default_rng(seed)
    poses = five().truth + rng.normal(0, 1, (5, 3)) * [2.0, 2.0, 0.2]
    scans = five().joint().scans
    pairs = overlaps(scans, poses, BOUND).pairs
    labels = connected_components(np.maximum(pairs, pairs.T) >= least)[1]
    expected = (labels == labels[scan]) | (np.arange(5) == scan)
    np.testing.assert_array_equal(connectivity(scans, poses, BOUND, least, scan)[0], expected)
    np.testing.assert_array_equal(connected_at(scans, poses, BOUND, least, scan), expected)


@given(st.integers(0, 10**6), st.integers(2, 8))
@settings(max_examples=50, deadline=None)
def test_the_weakest_link_is_the_least_of_the_tree_of_the_greatest(seed, count):
    pairs = np.random.default_rng(seed).uniform(0.01, 1.0, (count, count))
    tree = minimum_spanning_tree(1.0 - np.maximum(pairs, pairs.T) * (1 - np.eye(count)))
    assert weakest_link(pairs * (1 - np.eye(count))) == pytest.approx(1.0 - tree.max())


def test_a_scan_without_points_is_connected_to_itself_alone():
    nothing = np.empty((0, 2))
    points, ndts = [nothing, *five().points[1:]], [scan_ndt(nothing, OPTIONS), *five().ndts[1:]]
    scans = scan_set(ndts, points, neutral=False)
    assert connected_at(scans, five().truth, BOUND, 0.1, 0).tolist() == [True, False, False, False, False]
    assert not connected_at(scans, five().truth, BOUND, 0.1, 1)[0]
    assert connected_at(scans, five().truth, BOUND, 0.0, 1).all()
