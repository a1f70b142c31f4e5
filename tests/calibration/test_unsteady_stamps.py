"""Odometry that fits the scans at no offset, since stamps are now early and now late."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.odometry_fault_options import UnsteadyStampOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.consistency.repeated_maps import mirrored
from tests.data import data_file
from tests.logs.excerpts import excerpt
from tests.simulation import odometry_faults
from tests.simulation.scenes import office

OFF = replace(FileCheckOptions(), unsteady=UnsteadyStampOptions(max_disagreement=np.inf))


@functools.cache
def drive() -> LaserLog:
    scene = office()
    return scene.record_at(scene.truth()[:600], 5).log()


@functools.cache
def late_drive() -> LaserLog:
    """A real one whose scans are stamped when they are read, several at a time: its poses fit as recorded."""
    return odometry_faults.late(excerpt(read_log(str(data_file("intel.log.gz"))), slice(2000, 6000)), 1.0)


def late_to_be_read(log: LaserLog, longest: float) -> LaserLog:
    """The log with its scans stamped up to so many seconds late, beside odometry with right stamps."""
    assert log.odometry is not None
    times = np.sort(log.times + np.random.default_rng(3).uniform(0.0, longest, len(log)))
    turned = np.unwrap(log.odometry[:, 2])
    poses = [np.interp(times, log.times, column) for column in (*log.odometry[:, :2].T, turned)]
    return replace(log, times=times, odometry=np.stack(poses, axis=1), odometry_path=None)


def messages(log: LaserLog, options: FileCheckOptions = FileCheckOptions()) -> list[str]:
    return checked_file(log, ReadingOptions(), options).messages


def test_scans_that_are_stamped_several_at_a_time_leave_odometry_out():
    log = late_to_be_read(drive(), 0.8)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    (said,) = (message for message in checked.messages if message.startswith("odometry"))
    assert "stamps vary" in said
    assert checked.log.odometry is None
    assert not checked.reading.odometry
    assert not [message for message in messages(log, OFF) if "stamps vary" in message]


def test_odometry_of_a_real_robot_that_is_late_besides_is_not_blamed_for_its_scale():
    checked = checked_file(late_drive(), ReadingOptions(), FileCheckOptions())
    (said,) = checked.messages
    assert said.startswith(
        "odometry is stamped about 0.9 s too late, and contradicts the scans even if moved"
    )
    assert "with --clock-offset -0.9" in said
    assert checked.log.odometry is None
    assert not [message for message in messages(late_drive(), OFF) if "stamps vary" in message]


def test_what_seems_to_stand_because_it_is_late_is_not_named_besides():
    log = odometry_faults.late(excerpt(read_log(str(data_file("intel.log.gz"))), slice(9000, 13630)), 1.0)
    (said,) = messages(log)
    assert "stamps vary" in said
    assert any("stands still" in message for message in messages(log, OFF))


def test_stamps_that_are_late_by_the_same_time_are_moved():
    (said,) = messages(odometry_faults.late(drive(), 0.6))
    assert said.startswith("odometry is stamped 0.61 s too late")


def test_a_factor_of_turns_is_no_matter_of_stamps():
    for factor in (-1.0, 0.5, 2.0):
        said = messages(odometry_faults.turning(drive(), factor))
        assert not [message for message in said if "stamps vary" in message]


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic"])
def test_stamps_of_these_robots_are_steady_enough(name, every):
    log = read_log(str(data_file(f"{name}.log.gz")), ReadingOptions(every=every))
    for world in (log, mirrored(log)):
        assert not [message for message in messages(world) if "stamps vary" in message]
