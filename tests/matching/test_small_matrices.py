from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.matching.small_matrices import solve_definite


@pytest.mark.parametrize("size", [1, 3, 30])
def test_definite_systems_are_solved_and_others_refused(size):
    rng = np.random.default_rng(size)
    for _ in range(20):
        root, right, out = rng.normal(0, 1, (size, size)), rng.normal(0, 1, size), np.empty(size)
        matrix = root @ root.T + 0.1 * np.eye(size)
        assert solve_definite(matrix.copy(), right, out)
        np.testing.assert_allclose(matrix @ out, right, atol=1e-8)
        values, vectors = np.linalg.eigh(matrix)
        values[rng.integers(size)] *= -1
        assert not solve_definite((vectors * values) @ vectors.T, right, out)
        assert not solve_definite(np.full((size, size), np.nan), right, out)
