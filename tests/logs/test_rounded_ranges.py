"""Ranges that were rounded coarsely are named; those of real lasers are not."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.exports.carmen import corrected_log
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.rounded_ranges import rounding_of_ranges
from tests.data import OFFICE_LOG
from tests.simulation import faults

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


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda log: faults.ranges_rounded(log, 0.1), "the ranges are multiples of 0.1 m"),
        (lambda log: faults.noisy_ranges(log, 0.15), "ranges of beams beside each other scatter by"),
    ],
)
def test_a_log_that_is_read_says_so(changed, said, tmp_path):
    log = changed(read_log(str(OFFICE_LOG), ReadingOptions(end=60.0)))
    assert log.odometry is not None
    path = tmp_path / "changed.log"
    path.write_bytes(corrected_log(log, np.arange(len(log)), log.odometry))
    notices = read_log(str(path), ReadingOptions(allow_corrected=True)).report.notices()
    assert any(text.startswith(said) for text in notices)
