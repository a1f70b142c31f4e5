"""Times from stamps: sorted stably, counted when they step back, nominal when they say nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.scan_order import by_time, nearest_in_time, scans_by_time, selected_numbers


def test_sorted_stably_and_counted():
    order = by_time(["2.0", "3.0", "1.0", "2.0", "0.5", "9"])
    assert order.rows.tolist() == [4, 2, 0, 3, 1, 5]
    assert order.stamps == ["0.5", "1.0", "2.0", "2.0", "3.0", "9"]
    assert order.backward == 2
    assert len(order.warnings) == 1


@pytest.mark.parametrize(
    "stamps",
    [["0", "0", "0"], ["nan", "x", "1"], ["4.29497e+09"] * 9 + ["12"], ["", "", ""], ["1e300", "-inf", "2"]],
)
def test_stamps_that_say_nothing_leave_file_order(stamps):
    order = by_time(stamps)
    assert order.rows.tolist() == list(range(len(stamps)))
    np.testing.assert_allclose(order.times, 0.1 * np.arange(len(stamps)))
    assert order.stamps[1] == "0.100000"
    assert "file order" in order.warnings[0]


def test_a_single_bad_stamp_is_filled_in():
    order = by_time(["1.5", "nan", "2.5", "3.5"])
    assert order.times.tolist() == [1.5, 2.0, 2.5, 3.5]
    assert order.stamps == ["1.5", "2.000000", "2.5", "3.5"]


def test_one_scan_keeps_its_stamp():
    assert by_time(["17.25"]).stamps == ["17.25"]


@given(st.lists(st.floats(-1e6, 1e6).map(repr), min_size=1, max_size=30, unique=True))
def test_sorting_keeps_every_scan(stamps):
    order = by_time(stamps)
    assert sorted(order.rows.tolist()) == list(range(len(stamps)))
    assert (np.diff(order.times) >= 0).all()
    assert [float(stamp) for stamp in order.stamps] == order.times.tolist()


def test_selection_counts_from_the_first_scan():
    times = 100 + np.arange(10) / 2
    options = ReadingOptions(start=1.0, end=4.0, every=3)
    # 1.0 s … 4.0 s are the scans 2 … 8; of these every third.
    assert selected_numbers(times, options, "a.log").tolist() == [2, 5, 8]


def test_selection_of_nothing_is_wrong_usage():
    with pytest.raises(WrongUsageError, match=r"a\.log.*lasts 4\.5 s"):
        selected_numbers(np.arange(10) / 2, ReadingOptions(start=60.0), "a.log")


def test_a_clock_that_is_set_back_while_the_robot_drives_on_goes_on():
    """Two ways through the same 8 s: sorted, their scans would take turns."""
    times = np.concatenate([0.2 * np.arange(100), 12.0 + 0.2 * np.arange(100)])
    order = by_time([f"{time:.1f}" for time in times])
    np.testing.assert_array_equal(order.rows, np.arange(200))
    np.testing.assert_allclose(order.times, 0.2 * np.arange(200), atol=1e-9)
    assert order.stamps[99:101] == ["19.8", "20.000000"]
    assert order.backward == 0
    assert order.warnings == [
        "the clock was set back by 8.0 s at scan 100; later times are shifted to continue"
    ]


def test_scans_that_share_a_stamp_are_spread_up_to_the_next_one():
    """Two with each stamp, and a clock in whole seconds; after a pause none is drawn out."""
    times = 100.0 + 0.2 * np.arange(60)
    order = by_time([f"{time:.1f}" for time in np.repeat(times[::2], 2)])
    np.testing.assert_allclose(order.times, times, atol=1e-6)
    assert order.stamps[:3] == ["100.0", "100.200000", "100.4"]
    assert order.warnings == [
        "30 scans with the time stamp of the scan before: they are spread evenly up to the next stamp"
    ]
    times[30:] += 60.0
    order = by_time([f"{time:.0f}" for time in np.floor(times + 1e-6)])
    assert not order.nominal
    np.testing.assert_allclose(order.times, times, atol=1e-6)


def test_single_stamps_that_are_shared_stay():
    stamps = [f"{time:.1f}" for time in 0.2 * np.arange(60)]
    stamps[30] = stamps[29]
    order = by_time(stamps)
    assert order.stamps == stamps
    assert order.warnings == []


def test_messages_that_come_late_are_sorted_in():
    """They fill the gap that they left; nor is a clock set back that meets no time again."""
    times = 0.2 * np.arange(200)
    late = np.concatenate([times[:60], times[120:160], times[60:120], times[160:]])
    order = by_time([f"{time:.1f}" for time in late])
    np.testing.assert_allclose(order.times, times, atol=1e-9)
    apart = np.concatenate([times + 3600.0, times])
    assert np.all(np.diff(by_time([f"{time:.1f}" for time in apart]).times) > 0)


times = st.lists(st.integers(0, 640).map(lambda k: k / 64), min_size=1, max_size=12).map(sorted).map(np.array)


@given(times, times)
def test_nearest_is_what_a_search_of_all_finds(a: np.ndarray, b: np.ndarray):
    rows = nearest_in_time(a, b)
    np.testing.assert_array_equal(np.abs(a[rows] - b), np.abs(a[:, None] - b[None]).min(axis=0))


def test_a_clock_that_is_set_back_by_more_than_a_drive_lasts_goes_on():
    """As where it is 1970 from then on: no later stamp meets an earlier one."""
    times = 1.7e9 + 0.2 * np.arange(200)
    order = by_time([f"{time:.1f}" for time in np.concatenate([times[:120], times[120:] - 1.7e9])])
    assert order.rows.tolist() == list(range(200))
    np.testing.assert_allclose(np.diff(order.times), 0.2, atol=1e-6)
    assert order.warnings[0].startswith("the clock was set back by 1700000000.0 s at scan 120")


def test_scans_sent_twice_are_read_once_and_those_of_a_robot_that_stands_all():
    ranges = np.repeat(np.random.default_rng(1).uniform(1.0, 5.0, (4, 3)), 2, axis=0).astype(np.float32)
    ranges[4:6, 1] = np.nan
    stamps = [f"{row // 2}.0" for row in range(8)]
    order = scans_by_time(stamps, ranges)
    assert order.rows.tolist() == [0, 2, 4, 6]
    assert order.stamps == ["0.0", "1.0", "2.0", "3.0"]
    assert order.warnings == ["4 scans with the readings of the one before: left out"]
    ranges[5, 0] += 0.01
    assert scans_by_time(stamps, ranges).rows.tolist() == [0, 2, 4, 5, 6]
    without_times = scans_by_time(["0"] * 8, ranges)
    assert without_times.nominal
    assert len(without_times.rows) == 8


@pytest.mark.parametrize("often", [2, 3])
def test_a_laser_read_more_often_than_it_measures_is_read_once(often):
    """Few scans can be alike by chance, as those of a robot that stands."""
    readings = np.random.default_rng(1).uniform(1.0, 5.0, (30, 3)).astype(np.float32)
    ranges = np.repeat(readings, often, axis=0)
    stamps = [f"{0.1 * row:.1f}" for row in range(len(ranges))]
    assert scans_by_time(stamps, ranges).stamps == stamps[::often]
    assert scans_by_time(stamps[:12], ranges[:12]).stamps == stamps[:12]
