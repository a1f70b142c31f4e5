"""A reading that stands for none is left out; readings of walls never are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.repeated_reading import RepeatedReadingOptions, repeated_readings
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import OFFICE_LOG, data_file
from tests.logs.noisy_room import Readings, carmen, readings, recording
from tests.simulation.faults import dead_beams, dust


def limits(scans: int) -> RangeLimits:
    return RangeLimits(np.full(scans, 0.05), np.full(scans, 20.0), None, "", "")


def with_code(share: float, value: float, seed: int = 3) -> Readings:
    ranges = readings().copy()
    ranges[np.random.default_rng(seed).random(ranges.shape) < share] = value
    return ranges


def said(log: LaserLog) -> list[str]:
    return [text for text in log.report.contradictions if "for no reading" in text]


@given(st.floats(0.02, 0.55), st.floats(0.2, 12.0))
@settings(max_examples=30)
def test_a_reading_all_over_the_scans_is_found(share, value):
    found = repeated_readings(with_code(share, value), limits(40))
    assert list(found) == [np.float32(value)]
    assert list(found.values()) == [pytest.approx(share, abs=0.02)]


def test_two_such_readings_are_both_found():
    ranges = with_code(0.1, 0.2)
    ranges[np.random.default_rng(4).random(ranges.shape) < 0.04] = 5.0
    assert set(repeated_readings(ranges, limits(40))) == {np.float32(0.2), 5.0}


@given(st.sampled_from([0.01, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0]))
def test_rounded_readings_of_walls_are_distances(step):
    assert repeated_readings((np.round(readings() / step) * step).astype(np.float32), limits(40)) == {}


def test_what_is_seldom_or_nearly_everything_or_always_in_the_same_beams_is_left():
    options = RepeatedReadingOptions()
    assert repeated_readings(with_code(0.5 * options.min_share, 3.0), limits(40)) == {}
    assert repeated_readings(with_code(0.5 * (1.0 + options.max_share), 3.0), limits(40)) == {}
    dead = readings().copy()
    dead[:, :60] = 3.0
    assert repeated_readings(dead, limits(40)) == {}
    assert repeated_readings(readings()[:0], limits(0)) == {}
    assert repeated_readings(np.full((40, 180), np.inf, np.float32), limits(40)) == {}


def test_it_is_read_as_no_reading_and_said(read):
    ranges = with_code(0.2, 2.0)
    log = read(recording(ranges, range_max=20.0))
    (text,) = said(log)
    assert text.startswith("20% of the readings are exactly 2 m, in all directions")
    is_so = ranges == np.float32(2.0)
    assert np.isnan(log.ranges[is_so]).all()
    np.testing.assert_array_equal(log.ranges[~is_so], ranges[~is_so])
    assert log.report.lost["of one value"] == np.count_nonzero(is_so)
    assert "not a number" not in log.report.lost
    assert not said(read(recording(ranges), as_recorded=True))


def test_in_scans_whose_limits_leave_nothing_it_is_counted_with_the_others(read):
    ranges = with_code(0.2, 2.0)
    written = recording(ranges, range_max=20.0)
    written[1::2] = [
        one.with_scan(range_min=5.0, range_max=1.0) if k % 4 == 0 else one
        for k, one in enumerate(written[1::2])
    ]
    log = read(written)
    assert len(said(log)) == 1
    is_crossed = np.arange(len(ranges)) % 4 == 0
    counts = dict(log.report.lost)
    assert counts.pop("of one value") == np.count_nonzero(ranges[~is_crossed] == 2.0)
    assert list(counts.values()) == [ranges[is_crossed].size]


def test_a_text_log_too(tmp_path):
    file = tmp_path / "dust.log"
    file.write_bytes("\n".join(carmen(with_code(0.1, 0.6))).encode() + b"\n")
    assert len(said(read_log(str(file)))) == 1
    assert not said(read_log(str(file), ReadingOptions(as_recorded=True)))


@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel", "mit-killian", "fr-campus", "fr-clinic"])
def test_real_logs_have_none_unless_it_is_put_in(name, tmp_path):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert not said(log)
    file = tmp_path / "dust.log"
    file.write_bytes(with_own_angles(dust(log, 0.15, 0.1)))
    wrong = read_log(str(file))
    assert len(said(wrong)) == 1


def test_dead_beams_are_told_as_such(tmp_path):
    file = tmp_path / "dead.log"
    file.write_bytes(with_own_angles(dead_beams(read_log(OFFICE_LOG), 5.0)))
    log = read_log(str(file))
    assert not said(log)
    assert log.report.masked
