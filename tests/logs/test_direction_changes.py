"""Directions of beams that change in the file alone are put right, or named with the options for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.logs.direction_changes import corrected_directions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import data_file
from tests.logs.test_robot_parts import office_log, table_of
from tests.simulation import faults

HALF, THIRD = slice(200, None), slice(133, 266)
CHANGES: dict[str, tuple[Callable[[LaserLog], LaserLog], str]] = {
    "turned by 90° for a third": (lambda log: faults.turned_in(log, 0.5 * np.pi, THIRD), "133 to 265"),
    "turned by 30°": (lambda log: faults.turned_in(log, np.pi / 6, HALF), "200 to 399"),
    "twice as far apart": (lambda log: faults.beams_apart(log, 2.0, HALF), "200 to 399"),
    "half as far apart at the beginning": (
        lambda log: faults.beams_apart(log, 0.5, slice(0, 150)),
        "0 to 149",
    ),
}


def checked(log: LaserLog) -> tuple[LaserLog, list[str]]:
    """The log with the directions that are used, and what is said."""
    directions, said = corrected_directions(table_of(log), log.beam_counts(), 1)
    return replace(log, angle_min=directions.first, angle_increment=directions.step), said


@pytest.mark.parametrize("name", CHANGES)
def test_they_are_those_of_most_scans(name):
    change, scans = CHANGES[name]
    right, (said,) = checked(change(office_log()))
    assert said.startswith(f"the beams of scans {scans} begin at ")
    np.testing.assert_allclose(right.angle_min, office_log().angle_min)
    np.testing.assert_allclose(right.angle_increment, office_log().angle_increment)


def test_what_changes_in_truth_stays():
    """From half-way on the laser looks elsewhere, and the file says so."""
    log = office_log()
    rolled = log.ranges.copy()
    rolled[HALF] = np.roll(rolled[HALF], -90, axis=1)
    turned = faults.turned_in(log, 0.5 * np.pi, HALF)
    turned = replace(turned, ranges=rolled)
    same, said = checked(turned)
    assert said == []
    np.testing.assert_array_equal(same.angle_min, turned.angle_min)


def test_jitter_and_the_other_order_are_no_such_change():
    for log in (faults.first_directions_jitter(office_log(), 0.05), faults.mirrored_in(office_log(), HALF)):
        same, said = checked(log)
        assert said == []
        np.testing.assert_array_equal(same.angle_min, log.angle_min)


def test_in_doubt_the_options_are_named_that_read_all_scans_as_before(tmp_path):
    whole = read_log(str(data_file("mit-csail.log.gz")))
    path = tmp_path / "csail.log"
    path.write_bytes(with_own_angles(faults.beams_apart(whole, 2.0, slice(len(whole) // 2, None))))
    (said,) = read_log(str(path)).report.contradictions
    assert said.startswith("from scan 994 on the beams begin at -180° in steps of 1° by the file")
    assert said.endswith("try --angle-min -90 --angle-increment 0.5")
    angles = ReadingOptions(angle_min=-0.5 * np.pi, angle_increment=np.radians(0.5))
    read = read_log(str(path), angles)
    assert read.report.contradictions == ()
    np.testing.assert_allclose(read.angle_min, whole.angle_min, atol=1e-6)


def test_a_log_is_read_so_and_says_so(tmp_path):
    path = tmp_path / "office.log"
    path.write_bytes(with_own_angles(faults.turned_in(office_log(), 0.5 * np.pi, THIRD)))
    read, as_recorded = read_log(str(path)), read_log(str(path), ReadingOptions(as_recorded=True))
    (said,) = read.report.contradictions
    assert "these directions are used; --as-recorded believes the file" in said
    assert np.ptp(read.angle_min) == 0.0
    assert np.ptp(as_recorded.angle_min) == pytest.approx(0.5 * np.pi)
    assert as_recorded.report.contradictions == ()
