"""Bearings as logs write them, rounded, with gaps or uneven, and the fans that they make."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.text.bearings import are_degrees, even_bearings


def written(degrees: np.ndarray, unit: str, decimals: int) -> np.ndarray:
    values = degrees if unit == "degrees" else np.radians(degrees)
    return np.array([float(f"{value:.{decimals}f}") for value in values])


@pytest.mark.parametrize(("unit", "decimals"), [("degrees", 1), ("degrees", 3), ("rad", 3), ("rad", 6)])
@pytest.mark.parametrize(
    ("first", "step", "beams"), [(-90, 1, 181), (0, 1, 181), (90, -1, 180), (-90, 0.5, 361)]
)
def test_what_was_rounded_is_restored(unit, decimals, first, step, beams):
    found = even_bearings(written(first + step * np.arange(beams), unit, decimals), unit == "degrees")
    assert found is not None
    assert found.first == pytest.approx(math.radians(first), abs=1e-12)
    assert found.step == pytest.approx(math.radians(step), abs=1e-12)
    np.testing.assert_array_equal(found.places, np.arange(beams))


def test_steps_that_are_no_hundredths_stay():
    # A Hokuyo: 360°/1024. To 0.35° it would be 1° off at the last beam.
    bearings = written(-119.8828125 + 0.3515625 * np.arange(682), "rad", 6)
    found = even_bearings(bearings, False)
    assert found is not None
    last = found.first + found.step * 681
    assert last == pytest.approx(math.radians(119.53125), abs=1e-6)


def test_rounding_coarser_than_the_step():
    # 0.5° is 0.0087 rad: to two decimals neighbours have one bearing.
    found = even_bearings(written(-90 + 0.5 * np.arange(361), "rad", 2), False)
    assert found is not None
    np.testing.assert_allclose(np.degrees([found.first, found.step]), [-90, 0.5], atol=0.05)


def test_beams_that_were_left_out_leave_gaps():
    kept = np.delete(np.arange(181), [5, 6, 90, 91, 92])
    found = even_bearings(written(-90.0 + kept, "rad", 4), False)
    assert found is not None
    np.testing.assert_array_equal(found.places, kept)
    assert found.step == pytest.approx(math.radians(1), abs=1e-12)


def test_a_whole_turn_goes_on_over_half_a_turn():
    found = even_bearings((np.arange(360.0) + 180 + 10) % 360 - 180.0, True)
    assert found is not None
    assert math.degrees(found.first) == pytest.approx(10)
    np.testing.assert_array_equal(found.places, np.arange(360))


@pytest.mark.parametrize("bearings", [np.arange(20.0) ** 2, np.zeros(5), np.array([0.0, 1, 2, 2.5, 3, 4])])
def test_uneven_bearings_make_no_fan(bearings):
    assert even_bearings(bearings, True) is None


def test_a_single_beam():
    found = even_bearings(np.array([-1.57]), False)
    assert found is not None
    assert (found.first, found.places.tolist()) == (-1.57, [0])


def test_units_are_told_by_size():
    assert are_degrees(np.array([90.0, 180.0]))
    assert not are_degrees(np.array([1.5708, math.pi, 6.2832]))
    # One line that is out of its mind decides nothing.
    assert not are_degrees(np.array([1.57, 300.0, 1.57]))
    assert not are_degrees(np.array([]))
