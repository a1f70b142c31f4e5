"""The way with slips allowed for."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.graph.model import Pairwise
from nscan_cli.slam.keyframes.tracked_path import TrackedPath
from tests.slam.keyframe_drives import exact_path
from tests.slam.keyframe_walks import information


def test_slips_add_their_variances_by_the_length():
    """Golden: 4 m with 0.05 m/√m and 0.002 rad/√m are 0.1 m and 0.004 rad."""
    given = information(np.random.default_rng(4))
    relation = Pairwise((3, 8), np.array([4.0, 0, 0.1]), given, "track", 0.9)
    way = TrackedPath(0.05, 0.002)
    way.extend(relation, 4.0)
    (slipping,) = way.relations
    added = np.linalg.inv(slipping.information) - np.linalg.inv(given)
    np.testing.assert_allclose(added, np.diag([0.1, 0.1, 0.004]) ** 2, rtol=1e-6, atol=1e-12)
    assert (slipping.nodes, slipping.origin, slipping.score) == ((3, 8), "track", 0.9)
    np.testing.assert_array_equal(slipping.measurement, relation.measurement)


@pytest.mark.parametrize("count", [0, 1, 16, 17, 40])
def test_it_keeps_the_covariance_of_each_relation_however_long_it_grows(count):
    rng = np.random.default_rng(count)
    relations = [Pairwise((k, k + 1), np.zeros(3), information(rng), "track") for k in range(count)]
    way = exact_path(relations)
    assert len(way) == count
    assert way.covariances.shape == (count, 3, 3)
    for one, relation, covariance in zip(way.relations, relations, way.covariances, strict=True):
        np.testing.assert_allclose(one.information, relation.information, rtol=1e-9)
        np.testing.assert_allclose(covariance @ relation.information, np.eye(3), atol=1e-8)
