"""Ranges that were rounded coarsely are named; those of real lasers are not."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.rounded_ranges import rounding_of_ranges

RANGES = np.random.default_rng(2).uniform(0.3, 12.0, (100, 181)).astype(np.float32)


def rounded(step: float) -> np.ndarray:
    return (step * np.round(RANGES / step)).astype(np.float32)


@pytest.mark.parametrize("step", [0.1, 0.125, 0.25, 0.5])
def test_a_coarse_step_is_named(step):
    assert f"multiples of {step:.3g} m" in rounding_of_ranges(rounded(step))
    with_others = rounded(step)
    with_others[::3, ::7] = np.inf
    with_others[:, 5] = np.nan
    with_others[7, ::2] = 0.333
    assert f"multiples of {step:.3g} m" in rounding_of_ranges(with_others)


@pytest.mark.parametrize("step", [1e-3, 0.01, 0.05])
def test_a_fine_step_is_not(step):
    assert rounding_of_ranges(rounded(step)) == ""


def test_too_few_ranges_tell_nothing():
    assert rounding_of_ranges(rounded(0.1)[:2]) == ""
    assert rounding_of_ranges(np.full((100, 181), 3.0, dtype=np.float32)) == ""
    assert rounding_of_ranges(np.full((100, 181), np.inf, dtype=np.float32)) == ""
