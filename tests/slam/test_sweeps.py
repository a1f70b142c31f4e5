"""Lasers that turn while the robot drives are mapped as well as those that see at once."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from nscan_cli.evaluation.alignment import alignment
from nscan_cli.graph.model import turned_graph
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.mapping.occupancy import OCCUPIED, occupancy_grid
from nscan_cli.poses import compose, wrap
from tests.benchmarks.laser_kinds import turning
from tests.data import data_file
from tests.logs.excerpts import truth_of
from tests.simulation.drive import Drive
from tests.simulation.office import office_way, office_world
from tests.simulation.sweeping import SweptRecording, Turning, fine_path, record_swept
from tests.slam.mapped_logs import Mapped, mapped

WAY_POINTS = 7
"""Of the way through the office: out of the lobby, into a room and out again."""
TURN_RATE = 2.8
"""rad/s"""


@functools.cache
def recorded(turn: float) -> SweptRecording:
    """A small robot with a laser of 5 Hz that turns on the spot quickly."""
    path = fine_path(office_way()[:WAY_POINTS], Drive(speed=0.22, turn_rate=TURN_RATE))
    return record_swept("office", office_world(), path, turning(360, 3.5, 0.01, 0.01), Turning(turn=turn), 1)


def errors(found: Mapped) -> tuple[float, float]:
    """Root mean square of the positions (m), and the largest error of a heading (degrees)."""
    truth = truth_of(found.log)
    off = compose(alignment(found.graph.poses, truth).motion, found.graph.poses) - truth
    rms = float(np.sqrt((off[:, :2] ** 2).sum(axis=1).mean()))
    return rms, float(np.degrees(np.abs(wrap(off[:, 2])).max()))


def occupied_cells(found: Mapped, resolution: float = 0.05) -> int:
    log, rows = dataclasses.replace(found.log, mapped_path=found.graph.path), np.arange(len(found.log))
    grid = occupancy_grid(log, rows, found.graph.poses, resolution)
    return int(np.count_nonzero(grid.states() == OCCUPIED))


def test_a_drive_with_fast_turns_is_mapped_as_by_a_laser_that_sees_at_once():
    at_once, swept = mapped(recorded(0.0).log()), mapped(recorded(0.2).log())
    uncorrected = mapped(recorded(0.2).log(turn=0.0))
    for error, other, bad, least in zip(
        errors(swept), errors(at_once), errors(uncorrected), (0.005, 0.4), strict=True
    ):
        assert error <= max(1.5 * other, least)
        assert bad > 3 * error
    assert occupied_cells(swept) <= 1.05 * occupied_cells(at_once)
    # Rays that begin at one place leave walls of two thicknesses, at the right poses too.
    one_place = dataclasses.replace(swept, log=dataclasses.replace(swept.log, beam_times=None))
    assert occupied_cells(one_place) > 1.1 * occupied_cells(at_once)


def test_without_odometry_the_scans_tell_where_the_robot_is_between_two_turns_of_the_laser():
    """A turn that begins within a turn of the laser is seen by the beams between the middles of two turns."""
    found = [
        errors(mapped(dataclasses.replace(log, odometry=None, odometry_path=None)))
        for log in (recorded(0.0).log(), recorded(0.2).log(), recorded(0.2).log(turn=0.0))
    ]
    at_once, swept, uncorrected = found
    assert swept[0] <= 2 * at_once[0]
    assert uncorrected[0] > 2 * swept[0]
    assert swept[1] <= max(2 * at_once[1], 0.4)
    assert uncorrected[1] > 20 * swept[1]


def test_the_path_of_the_graph_makes_maps_sharper_than_its_poses_alone():
    """The robot sways within a turn of the laser, which poses at its first beams do not tell."""
    log = read_log(str(data_file("field/urg-corridor-2.bag")), ReadingOptions(odometry=False))
    found = mapped(log)
    without = dataclasses.replace(found, graph=dataclasses.replace(found.graph, path=None))
    assert occupied_cells(found) < 0.95 * occupied_cells(without)


def test_the_path_goes_along_with_the_poses():
    found = mapped(recorded(0.2).log())
    log = dataclasses.replace(found.log, mapped_path=found.graph.path)
    turned = turned_graph(found.graph, 0.7)
    for row in (5, 150):
        seen = log.moving_along(found.graph.poses).points(row)
        np.testing.assert_allclose(log.moving_along(turned.poses).points(row), seen, atol=1e-9)


def test_a_laser_that_sees_at_once_needs_no_path():
    assert mapped(recorded(0.0).log()).graph.path is None
