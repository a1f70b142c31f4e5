"""A log of which no reading counts is refused with the reasons counted; one of which few do is told so."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from tests.logs.noisy_room import readings, recording
from tests.logs.recordings.messages import Scan

ALL = 40 * 180
MILLIMETRES = "looks like millimetres; ranges must be in metres: give --range-scale 0.001"


def filled(value: float) -> np.ndarray:
    return np.full((40, 180), value, dtype=np.float32)


@pytest.mark.parametrize(
    ("ranges", "changes", "said"),
    [
        (filled(math.inf), {}, "none of its 7,200 readings is usable: 7,200 are infinite; give a log"),
        (filled(math.nan), {}, "7,200 are not a number; give a log with valid readings"),
        (filled(0.0), {}, "7,200 are 0 or less;"),
        (filled(-1.0), {}, "7,200 are 0 or less;"),
        (filled(0.02), {}, "nearer than 0.05 m (range_min of the messages); if they are valid, set"),
        (filled(12.0), {}, "at a peak of readings without return); give a log"),
        (readings(), {"range_max": 0.5}, "0.5 m (range_max of the messages); if they are valid, set"),
        (readings(), {"range_min": 12.0, "range_max": 0.05},
         "in scans whose lower limit, 12 m (range_min of the messages), is not below the upper, 0.05 m "
         "(range_max of the messages); if they are valid, set --min-range and --max-range"),
    ],
)  # fmt: skip
def test_no_reading_that_counts_is_an_error(read, ranges, changes: dict[str, Any], said):
    with pytest.raises(InputDataError) as error:
        read(recording(ranges, **changes))
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    # What tells about a log shows it all the same.
    log = read(recording(ranges, **changes), even_unusable=True)
    assert sum(log.report.lost.values()) == ALL
    assert not np.isfinite(log.ranges).any()


def test_readings_of_several_kinds_are_counted_by_kind(read):
    ranges = 1000 * readings()
    ranges[:10], ranges[10:15], ranges[15, :3] = math.inf, 0.0, math.nan
    with pytest.raises(
        InputDataError, match="3 are not a number, 900 are 0 or less, 1,800 are infinite, 4,497"
    ) as error:
        read(recording(ranges), as_recorded=True)
    assert MILLIMETRES in str(error.value)


def test_options_that_leave_nothing_are_named(read):
    with pytest.raises(InputDataError, match=r"beyond 0.5 m \(--max-range\); choose another --max-range"):
        read(recording(readings()), max_range=0.5)
    with pytest.raises(InputDataError, match=r"; choose another --min-range$"):
        read(recording(readings()), min_range=50.0, max_range=60.0)
    with pytest.raises(
        InputDataError, match=r"lower limit, 50 m \(--min-range\), is not below the upper, 12 m"
    ):
        read(recording(readings()), min_range=50.0)


def test_limits_the_wrong_way_round_yield_to_options(read):
    log = read(recording(readings(), range_min=12.0, range_max=0.05), min_range=0.05, max_range=20.0)
    assert np.isfinite(log.ranges).all()
    assert log.report.warnings == ()


def test_limits_the_wrong_way_round_in_some_scans(read):
    written = recording(readings(), range_max=20.0)
    for at in range(1, 21, 2):
        assert isinstance(written[at].content, Scan)
        written[at] = written[at].with_scan(range_min=20.0, range_max=0.05)
    log = read(written)
    assert np.isnan(log.ranges[:10]).all()
    assert np.isfinite(log.ranges[10:]).all()
    why = (
        "in scans whose lower limit, 20 m (range_min of the messages), is not below the upper, 0.05 m "
        "(range_max of the messages)"
    )
    assert log.report.lost == {why: 1800}
    blind, said = log.report.warnings
    assert blind.startswith("the laser sees nothing from scan 0 to 9")
    assert said == f"1,800 of 7,200 readings are unusable: {why}"


def test_few_readings_that_count_are_told_with_the_reasons_and_used(read):
    ranges = readings()
    ranges[np.random.default_rng(1).random(ranges.shape) < 0.96] = 0.0
    log = read(recording(ranges, range_max=20.0))
    zeros = int((ranges == 0).sum())
    assert log.report.warnings == (
        f"only {ALL - zeros:,} of 7,200 readings are usable: {zeros:,} are 0 or less",
    )
    np.testing.assert_array_equal(np.isfinite(log.ranges), ranges > 0)


def test_of_an_open_field_for_a_part_of_the_way_only_the_stretch_is_told(read):
    ranges = readings()
    ranges[5:38] = math.inf
    (said,) = read(recording(ranges, range_max=20.0)).report.warnings
    assert said.startswith("the laser sees nothing from scan 5 to 37")
