"""The clock of odometry, by the turns of a finished map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.moved_stamps import with_delay, with_moved_part
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import wrap
from nscan_cli.slam.clock_by_map import clock_by_map, turns_of_map
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import SlamOptions
from tests.slam.keyframe_drives import round_scene

OPTIONS = FileCheckOptions()


@pytest.mark.parametrize("seconds", [-1.1, -0.4, 0.3, 0.8])
def test_turns_of_the_map_tell_how_late_odometry_is(seconds):
    log = round_scene().record(5).log()
    assert log.truth is not None
    found = clock_by_map(with_delay(log, seconds), log.truth, [], ReadingOptions(), OPTIONS)
    assert found is not None
    assert found.reading.clock_offset == pytest.approx(-seconds, abs=0.03)
    (said,) = found.messages
    assert f"--clock-offset {found.reading.clock_offset:g}," in said
    assert_is_odometry_of(log, found.log)


@pytest.mark.parametrize("seconds", [-5.0, -0.5, 1.0])
def test_turns_of_the_map_tell_where_a_clock_was_set(seconds):
    log = round_scene().record(5).log()
    assert log.truth is not None
    place = float(log.times[int(0.4 * len(log))])
    found = clock_by_map(with_moved_part(log, place, seconds, True), log.truth, [], ReadingOptions(), OPTIONS)
    assert found is not None
    (said,) = found.messages
    assert "a clock was set there" in said
    assert found.reading == ReadingOptions()
    assert_is_odometry_of(log, found.log)


def test_turns_of_a_map_that_fit_change_nothing():
    log = round_scene().record(5).log()
    assert log.truth is not None
    assert clock_by_map(log, log.truth, [], ReadingOptions(), OPTIONS) is None
    late = replace(with_delay(log, 0.8), odometry=None)
    assert clock_by_map(late, log.truth, [], ReadingOptions(), OPTIONS) is None


def assert_is_odometry_of(log: LaserLog, found: LaserLog) -> None:
    """Four fifths of the odometry are within 3 cm of that of a log, and at most a fifth is left out."""
    assert found.odometry is not None
    assert log.odometry is not None
    off = np.hypot(*(found.odometry - log.odometry)[:, :2].T)
    known = np.isfinite(off)
    assert known.mean() > 0.8
    assert np.mean(off[known] < 0.03) > 0.8


def test_turns_lead_over_no_break_and_no_gap():
    times = np.arange(200) / 10.0
    times[120:] += 5.0
    headings = 0.03 * np.arange(200.0)
    poses = np.column_stack([np.zeros((200, 2)), wrap(headings)])
    is_known = np.full(200, True)
    is_known[160:165] = False
    turns = turns_of_map(times, poses, [50, 77], is_known, OPTIONS)
    np.testing.assert_allclose(turns.turned, 0.3 * (turns.ends - turns.begins), atol=1e-9)
    assert (turns.turned >= 0.06).all()
    assert (turns.turned <= 0.16).all()
    for at in (4.95, 7.65, 14.0, 21.2):
        assert not ((turns.begins < at) & (at < turns.ends)).any()
    assert len(turns.turned) >= 200 * 0.03 / 0.1 - 7


def test_a_drive_whose_check_told_no_delay_is_mapped_again_with_it():
    log = with_delay(round_scene().record(5).log(), -0.6)
    drive = map_drive(log, SlamOptions())
    assert drive.reading.clock_offset == pytest.approx(0.6, abs=0.03)
    assert drive.messages[0].startswith("odometry is stamped 0.59 s too early")
    for reading in (ReadingOptions(as_recorded=True), ReadingOptions(clock_offset=0.05)):
        left = map_drive(log, SlamOptions(), reading=reading)
        assert left.messages == []
        assert left.reading == reading
