from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.evaluation.options import EvaluationOptions
from nscan_cli.evaluation.time_association import mutual_nearest

# Multiples of 1/64 s: differences are exact, and many times are equal.
times = st.lists(st.integers(0, 640).map(lambda k: k / 64), min_size=1, max_size=12).map(sorted).map(np.array)


@given(times, times)
def test_matches_are_pairs_and_close(a: np.ndarray, b: np.ndarray):
    rows, partners = mutual_nearest(a, b)
    assert len(set(rows.tolist())) == len(set(partners.tolist())) == len(rows)
    assert (np.abs(a[rows] - b[partners]) <= EvaluationOptions.tolerance).all()


def test_a_dense_trajectory_matches_a_sparse_one_once():
    dense = np.arange(0, 1, 0.01)
    sparse = np.array([0.104, 0.503, 7.0])
    rows, partners = mutual_nearest(dense, sparse)
    assert (rows.tolist(), partners.tolist()) == ([10, 50], [0, 1])
    rows, partners = mutual_nearest(sparse, dense)
    assert (rows.tolist(), partners.tolist()) == ([0, 1], [10, 50])
