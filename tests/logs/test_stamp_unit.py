"""Stamps in milliseconds, microseconds or nanoseconds are told by their size and the time between scans."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.scan_order import by_time
from nscan_cli.logs.stamp_unit import UNITS_OF_TIME, StampUnitOptions, stamp_unit
from nscan_cli.poses import Array

LEAST = StampUnitOptions().min_scans


def drive(period: float = 0.1, size: int = 200) -> Array:
    """Times (size,) whose periods vary a little, s."""
    return 1.7e9 + np.cumsum(period * np.random.default_rng(1).uniform(0.8, 1.2, size))


@pytest.mark.parametrize("unit", UNITS_OF_TIME)
@pytest.mark.parametrize("period", [0.025, 0.1, 5.0])
def test_the_unit_is_found(unit, period):
    assert stamp_unit(drive(period) / unit.seconds) == unit
    assert stamp_unit(drive(period)) is None


@pytest.mark.parametrize("unit", UNITS_OF_TIME)
def test_stamps_since_1970_tell_their_unit_however_uneven(unit):
    times = 1.7e9 + np.cumsum(np.random.default_rng(1).choice([1e-3, 0.1, 0.5], 20))
    assert stamp_unit(times / unit.seconds) == unit
    assert stamp_unit(times) is None


@pytest.mark.parametrize("unit", UNITS_OF_TIME)
@pytest.mark.parametrize("start", [100.0, 2e3, 1e6, 1.7e9])
def test_a_clock_that_began_at_any_time(unit, start):
    """2,000 s in nanoseconds were taken for milliseconds since 1970."""
    times = drive() - 1.7e9 + start
    assert stamp_unit(times / unit.seconds) == unit
    assert stamp_unit(times) is None


@pytest.mark.parametrize("unit", UNITS_OF_TIME)
def test_stamps_are_converted_and_it_is_said(unit):
    times = drive()
    order = by_time([f"{time / unit.seconds:.0f}" for time in times])
    np.testing.assert_allclose(order.times, times, atol=1e-3)
    assert float(order.stamps[7]) == pytest.approx(times[7], abs=1e-3)
    assert not order.nominal
    assert order.warnings == [f"the time stamps are in {unit.name}: they are multiplied by {unit.seconds:g}"]


def test_a_few_scans_and_scans_at_stops_tell_no_unit():
    assert stamp_unit(1e3 * (drive() - 1.7e9)[: LEAST - 1]) is None
    assert stamp_unit(np.cumsum(np.random.default_rng(1).uniform(10.0, 200.0, 200))) is None
    assert stamp_unit(np.zeros(0)) is None
    assert stamp_unit(np.full(200, 5.0)) is None
