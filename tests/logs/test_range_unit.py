"""The unit of the ranges: what is beyond doubt is put right, and what is likely is told with the option."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file
from tests.logs import lines
from tests.logs.noisy_room import carmen, readings, recording

CASES = [(1000, "millimetres", 0.001), (100, "centimetres", 0.01)]


@pytest.mark.parametrize(("factor", "unit", "scale"), CASES)
@pytest.mark.parametrize("unit_of_limits", [1, None])
def test_a_unit_beyond_doubt_is_put_right_and_said(read, factor, unit, scale, unit_of_limits):
    """Whether the limits are in metres or in the same unit."""
    times = unit_of_limits or factor
    written = recording(factor * readings(), range_min=0.05 * times, range_max=9.9 * times)
    log = read(written)
    np.testing.assert_allclose(log.ranges, np.where(readings() < 9.9, readings(), np.inf), atol=1e-5)
    np.testing.assert_allclose(log.range_limits, (0.05, 9.9), rtol=1e-6)
    (said,) = log.report.contradictions
    assert f"looks like {unit}: the ranges are multiplied by {scale:g}; --as-recorded" in said
    assert said in log.report.notices()
    # The option says the same, and nothing is left to say.
    asked = read(written, range_scale=scale)
    np.testing.assert_array_equal(asked.ranges, log.ranges)
    assert asked.range_limits == log.range_limits
    assert asked.report.contradictions == ()


@pytest.mark.parametrize(("factor", "unit", "scale"), CASES)
def test_a_log_as_recorded_is_refused_with_the_option(read, factor, unit, scale):
    with pytest.raises(InputDataError, match=f"looks like {unit}; .*: give --range-scale {scale:g}"):
        read(recording(factor * readings()), as_recorded=True)


@pytest.mark.parametrize(("factor", "unit", "scale"), CASES)
def test_a_text_log_in_another_unit(tmp_path, factor, unit, scale):
    log = lines.read(tmp_path, *carmen(factor * np.maximum(readings(), 1.0)))
    np.testing.assert_allclose(log.ranges, np.maximum(readings(), 1.0), atol=0.01)
    assert f"looks like {unit}: the ranges are multiplied by {scale:g}" in log.report.contradictions[0]


@pytest.mark.parametrize(("factor", "scale"), [(0.01, 100), (0.001, 1000)])
@pytest.mark.parametrize("unit_of_limits", [1.0, None])
def test_metres_that_were_divided_are_put_right_and_said(read, factor, scale, unit_of_limits):
    times = unit_of_limits or factor
    log = read(recording(factor * readings(), range_min=0.0, range_max=9.9 * times))
    np.testing.assert_allclose(log.ranges, np.where(readings() < 9.9, readings(), np.inf), atol=1e-4)
    assert log.range_limits[1] == pytest.approx(9.9)
    (said,) = log.report.contradictions
    assert f"which looks like metres divided by {scale}: the ranges are multiplied by {scale}" in said


def test_whole_numbers_hide_no_unit(read):
    """Those of 80 look like a peak of readings without return at the limit."""
    near = 0.4 * readings(200)
    # Odometry is that of a larger room.
    scans = [
        message for message in recording(np.round(100 * near), range_max=80.0) if message.topic == "/scan"
    ]
    log = read(scans)
    np.testing.assert_allclose(log.ranges, near, atol=0.006)
    assert "looks like centimetres: the ranges are multiplied by 0.01" in log.report.contradictions[0]


def test_a_code_for_no_return_is_no_unit(read):
    """Most beams say 1000, some the limit, and the others metres."""
    ranges, rng = readings(), np.random.default_rng(4)
    ranges[rng.random(ranges.shape) < 0.7] = 1000.0
    ranges[rng.random(ranges.shape) < 0.1] = 12.0
    log = read(recording(ranges))
    assert log.report.contradictions == ()
    assert np.isfinite(log.ranges).mean() > 0.2


def test_intensities_are_no_ranges(read):
    """Numbers from 0 to 255 whose neighbours have nothing in common: no unit makes walls of them."""
    numbers = np.random.default_rng(4).uniform(0.0, 255.0, readings().shape)
    log = read(recording(numbers.astype(np.float32), range_max=300.0))
    assert log.report.contradictions == ()
    assert not [said for said in log.report.notices() if "centimetres" in said]


def test_two_units_that_fit_are_both_named(read):
    """Half of the returns are beyond 900: 9 m or 0.9 m."""
    ranges = readings() * np.float32(900 / np.median(readings()))
    with pytest.raises(InputDataError, match=r"give --range-scale 0.01 or 0.001$"):
        read(recording(ranges, range_max=30.0))


def test_readings_of_the_open_are_told_and_not_put_right(read):
    """A limit that is too low for them does not make metres centimetres."""
    log = read(recording(readings() * np.float32(35 / np.median(readings())), range_max=20.0))
    assert log.report.contradictions == ()
    assert np.isfinite(log.ranges).any()


def test_centimetres_of_a_narrow_place_are_told(read):
    """Half of the returns are beyond 80: 80 m cannot be excluded."""
    log = read(recording(readings() * np.float32(80 / np.median(readings())), range_max=0.0))
    assert log.report.contradictions == ()
    assert (
        "looks like centimetres; ranges must be in metres: give --range-scale 0.01" in log.report.warnings[0]
    )


@pytest.mark.parametrize("changes", [{}, {"range_max": 0.0}, {"range_max": 80.0}])
def test_metres_are_left_alone(read, changes: dict[str, Any]):
    log = read(recording(readings(), **changes))
    assert log.report.contradictions == ()
    np.testing.assert_array_equal(log.ranges, read(recording(readings(), **changes), as_recorded=True).ranges)


def test_a_scale_is_positive():
    with pytest.raises(WrongUsageError, match="--range-scale has to be above 0"):
        ReadingOptions(range_scale=0.0)


@pytest.mark.logs
def test_the_recording_of_a_stranger():
    log = read_log(str(data_file("strangers/millimetres.mcap")))
    assert log.range_limits == pytest.approx((0.05, 12.0))
    assert 2.0 < float(np.median(log.ranges)) < 3.5
    assert len(log.report.contradictions) == 1


@pytest.mark.parametrize(("beams", "corrections"), [(40, 0), (60, 1)])
def test_a_few_returns_do_not_prove_a_unit(read, beams, corrections):
    """Those at 300 may be 3 m in centimetres, or a hill."""
    ranges = np.full((1, beams), 300.0, dtype=np.float32)
    assert len(read(recording(ranges, range_max=0.0)).report.contradictions) == corrections
