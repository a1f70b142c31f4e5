"""What a finished map contradicts of its file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import compose, inverse, relative
from nscan_cli.slam.contradictions_by_map import contradictions_by_map, steps_of_map
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import SlamOptions
from tests.data import data_file
from tests.logs.excerpts import excerpt, truth_of
from tests.simulation import odometry_faults
from tests.slam.keyframe_drives import round_scene

OPTIONS, READING = FileCheckOptions(), ReadingOptions()
ELSEWHERE = np.array([0.3, -0.25, 0.0])


def test_a_map_tells_that_the_laser_is_elsewhere_on_the_robot():
    log = round_scene().record(5).log()
    lasers = log.laser_pose(truth_of(log))
    moved = replace(log, mount=log.mount + ELSEWHERE)
    by_map = compose(lasers, inverse(moved.mount))
    (found,) = contradictions_by_map(moved, by_map, [], READING, OPTIONS)
    assert found.is_of_mount
    assert "-0.30 m ahead and +0.25 m to the left" in found.message


@pytest.mark.parametrize("seconds", [-5.0, 3.0])
def test_a_wrong_clock_is_left_to_those_who_look_for_it(seconds):
    log = odometry_faults.late(round_scene().record(5).log(), seconds)
    assert contradictions_by_map(log, truth_of(log), [], READING, OPTIONS) == []


def test_odometry_whose_turns_are_wrong_is_named_and_kept():
    log = odometry_faults.turning(round_scene().record(5).log(), 0.5)
    (found,) = contradictions_by_map(log, truth_of(log), [], READING, OPTIONS)
    assert "turns by odometry are 0.5" in found.message
    drive = map_drive(log, SlamOptions())
    assert [said for said in drive.messages if "odometry likely turns wrongly" in said]
    assert drive.graph.odometry is not None


def test_a_true_map_of_a_true_file_contradicts_nothing():
    log = round_scene().record(5).log()
    assert contradictions_by_map(log, truth_of(log), [], READING, OPTIONS) == []
    without = replace(log, odometry=None)
    assert contradictions_by_map(without, truth_of(log), [], READING, OPTIONS) == []


def test_steps_of_a_map_are_those_of_its_lasers_but_over_breaks():
    log = round_scene().record(5).log()
    known = steps_of_map(log, truth_of(log), [100, 150], OPTIONS)
    lasers = log.laser_pose(truth_of(log))
    assert len(known) > 300
    for (first, last), step in known.items():
        if first < 100 <= last or first < 150 <= last:
            assert step is None
        else:
            assert step is not None
            np.testing.assert_allclose(step[0], relative(lasers[last], lasers[first]), atol=1e-9)


def test_outdoors_the_map_tells_what_few_steps_did_not():
    """A tenth of fr-campus: of its first steps too few turn."""
    log = excerpt(read_log(str(data_file("fr-campus.log.gz"))), slice(0, 1000))
    wrong = replace(log, mount=log.mount + np.array([0.0, 0.3, 0.0]))
    (said,) = map_drive(wrong, SlamOptions()).messages
    assert "the laser is likely elsewhere on the robot than the file says" in said
    assert "-0.2" in said.split("ahead and ")[1].split(" m to the left")[0]
    assert map_drive(wrong, SlamOptions(), has_findings=True).messages == []
    assert map_drive(wrong, SlamOptions(), reading=ReadingOptions(as_recorded=True)).messages == []
    assert map_drive(log, SlamOptions()).messages == []
