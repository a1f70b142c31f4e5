"""Odometry that counts lengths otherwise over a part of a log is put right there."""

from __future__ import annotations

import functools
import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.contradictions import find_contradictions
from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.measured_steps import KnownSteps
from nscan_cli.calibration.odometry_fault_options import ScaledStretchOptions
from nscan_cli.calibration.odometry_options import DelayOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.scaled_stretches import scaled_stretches
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, relative
from tests.data import data_file
from tests.logs.excerpts import excerpt
from tests.simulation import odometry_faults, things_beside
from tests.simulation.scenes import office

OPTIONS = FileCheckOptions()
AS_STAMPED = replace(OPTIONS, lag=DelayOptions(least=np.inf))
"""With a delay that is put right as well, steps would not be those that were recorded."""
ONE_METRE = r"from scan (\d+) to (\d+) one metre by odometry is ([\d.]+) m by scans"


@functools.cache
def drive() -> LaserLog:
    scene = office()
    return scene.record_at(scene.truth()[:600], 5).log()


@functools.cache
def intel() -> LaserLog:
    """Its stamps jitter, and it turns on the spot with its laser ahead of the middle."""
    return excerpt(read_log(str(data_file("intel.log.gz"))), slice(5000, 9500))


@functools.cache
def killian() -> LaserLog:
    return excerpt(read_log(str(data_file("mit-killian.log.gz"))), slice(3500, 7000))


def steps(log: LaserLog) -> Array:
    assert log.odometry is not None
    return relative(log.odometry[1:], log.odometry[:-1])


def check_put_right(log: LaserLog, factor: float, rows: slice, within: int) -> None:
    checked = checked_file(odometry_faults.scaled_in(log, factor, rows), ReadingOptions(), AS_STAMPED)
    (said,) = (message for message in checked.messages if message.startswith("from scan"))
    found = re.match(ONE_METRE, said)
    assert found is not None
    assert float(found[3]) == pytest.approx(1.0 / factor, rel=0.08)
    begin, end = rows.start, rows.stop if rows.stop is not None else len(log)
    assert abs(int(found[1]) - log.numbers[begin]) <= within
    assert abs(int(found[2]) - log.numbers[end - 1]) <= within
    mended, recorded = steps(checked.log), steps(log)
    known = np.isfinite(mended[:, 0])
    assert np.count_nonzero(~known) <= 2 * within
    off = np.hypot(*(mended - recorded)[known, :2].T)
    way = float(np.hypot(*recorded[:, :2].T).sum())
    assert float(off.sum()) < max(0.01, 0.5 * abs(1.0 / float(found[3]) / factor - 1.0)) * way + 0.5


@pytest.mark.parametrize("rows", [slice(200, 400), slice(0, 250), slice(350, None)])
@pytest.mark.parametrize("factor", [0.001, 0.01, 0.1, 4.0, 10.0])
def test_a_stretch_is_scaled_and_said(factor, rows):
    check_put_right(drive(), factor, rows, 15)


@pytest.mark.parametrize("factor", [0.001, 0.01, 0.1])
def test_a_stretch_of_a_real_log_is_too(factor):
    check_put_right(intel(), factor, slice(1350, 2700), 70)


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_so_is_one_in_long_corridors(factor):
    check_put_right(killian(), factor, slice(1050, 2100), 70)


def test_the_path_between_the_scans_is_scaled_too():
    log = odometry_faults.scaled_in(drive(), 0.1, slice(200, 400))
    assert log.odometry is not None
    checked = checked_file(
        replace(log, odometry_path=robot_path(log.times, log.odometry)), ReadingOptions(), OPTIONS
    ).log
    assert checked.odometry is not None
    assert checked.odometry_path is not None
    known = np.isfinite(checked.odometry[:, 0])
    at = np.searchsorted(checked.odometry_path.times, checked.times[known])
    np.testing.assert_allclose(checked.odometry_path.poses[at, :2], checked.odometry[known, :2], atol=1e-9)


def test_the_file_is_believed_where_the_check_is_off_or_nobody_asks():
    log = odometry_faults.scaled_in(drive(), 0.1, slice(200, 400))
    never = replace(OPTIONS, stretches=ScaledStretchOptions(min_factor=np.inf))
    as_recorded = ReadingOptions(as_recorded=True)
    for reading, options in ((ReadingOptions(), never), (as_recorded, OPTIONS)):
        messages = checked_file(log, reading, options).messages
        assert not [message for message in messages if message.startswith("from scan")]


@pytest.mark.parametrize(
    "fault",
    [
        lambda log: log,
        lambda log: odometry_faults.scaled(log, 0.01),
        lambda log: odometry_faults.scaled_in(log, 1.5, slice(200, 400)),
        lambda log: odometry_faults.held(log, slice(200, 400), False),
        lambda log: things_beside.leader(log, 0.6),
    ],
)
def test_nothing_else_is_taken_for_it(fault):
    messages = checked_file(fault(drive()), ReadingOptions(), OPTIONS).messages
    assert not [message for message in messages if message.startswith("from scan")]


def test_odometry_that_stands_and_trembles_has_no_scale():
    """A tenth of a millimetre to the right from scan to scan is no thousandth of the robot's way."""
    log = odometry_faults.held(drive(), slice(0, 200), False)
    assert log.odometry is not None
    moved = log.odometry.copy()
    moved[:200, 1] -= 1e-4 * np.arange(200)
    known: KnownSteps = {}
    log = replace(log, odometry=moved)
    find_contradictions(log, ReadingOptions(), OPTIONS, known)
    assert scaled_stretches(log, OPTIONS, known) == []
    anywhere = replace(OPTIONS, stretches=ScaledStretchOptions(max_aside=np.pi))
    assert len(scaled_stretches(log, anywhere, known)) == 1


def test_somebody_who_leads_does_not_make_odometry_longer():
    """Over a part of this drive most steps by scans are his, a fifth of those by odometry."""
    log = things_beside.leader(read_log(str(data_file("mit-csail.log.gz"))), 0.6)
    messages = checked_file(log, ReadingOptions(), OPTIONS).messages
    assert not [message for message in messages if message.startswith("from scan")]
