"""How far beams reach, against the same computed for every one of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.mapping.ray_casting import ScanRays, SweptRays, ray_bounds

REACH = 6.0


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_the_extent_is_that_of_all_ends_and_lasers(seed, size):
    random = np.random.default_rng(seed)
    # Few of them are long: these alone, wherever they are, make the extent.
    ranges = random.choice([0.1, 0.5, 1.0, 9.0, np.inf, np.nan], (size + 3, 5)).astype(np.float32)
    first, step = random.uniform(-3, 3, size + 3), random.uniform(-1, 1, size + 3)
    rows, lasers = random.permutation(size + 3)[:size], random.uniform(-4, 4, (size, 3))
    lengths = np.where(np.isfinite(ranges[rows]), np.minimum(ranges[rows], REACH), 0.0)
    angles = lasers[:, 2:] + first[rows, None] + np.arange(5) * step[rows, None]
    ends = lasers[:, None, :2] + lengths[..., None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    reached = np.concatenate([ends.reshape(-1, 2), lasers[:, :2]])
    corners = [*reached.min(axis=0), *reached.max(axis=0)]
    scans = ScanRays(rows, ranges, first, step, lasers, SweptRays.at_once())
    assert ray_bounds(scans, REACH) == pytest.approx(corners, abs=1e-9)
