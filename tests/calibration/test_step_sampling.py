"""Which steps are measured: none that begins or ends with a scan that repeats the one before."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_sampling import possible_steps
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from tests.slam.keyframe_drives import round_scene


@functools.cache
def drive() -> LaserLog:
    return round_scene().record(5).log()


def slower_than_the_log(times: int) -> LaserLog:
    """Each scan is written so many times, with the odometry of its own time."""
    return replace(drive(), ranges=drive().ranges[np.arange(len(drive())) // times * times])


def test_scans_that_repeat_the_one_before_begin_and_end_no_step():
    first, last = possible_steps(slower_than_the_log(3), FileCheckOptions().steps)
    assert len(first)
    assert not (first % 3).any()
    assert not (last % 3).any()
    assert len(possible_steps(drive(), FileCheckOptions().steps)[0]) > 2.5 * len(first)


def test_a_laser_slower_than_the_log_contradicts_nothing():
    assert checked_file(slower_than_the_log(3), ReadingOptions(), FileCheckOptions()).messages == []
