"""Lasers that see a narrow sector or a few metres: where they tell little, good odometry leads."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.measured_steps import measure_steps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, relative, wrap
from nscan_cli.slam import pipeline
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import SlamOptions
from tests.benchmarks.laser_kinds import GOOD, NARROW, recorded
from tests.benchmarks.lasers import rms
from tests.logs.excerpts import excerpt
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.scenes import Scene
from tests.simulation.world import Builder


@functools.cache
def driven(kind: str, seed: int) -> tuple[LaserLog, Array]:
    """The first scans of a drive of the benchmark, and their true poses."""
    (laser,) = (each for each in NARROW if each.name.startswith(kind))
    log, truth = recorded(laser, seed, GOOD)
    return excerpt(log, slice(0, 2500)), truth[:2500]


@pytest.mark.parametrize(
    ("kind", "seed"), [("warehouse: 181", 2), ("warehouse: 360", 2), ("bare corridors: 241", 3)]
)
def test_the_map_is_nearer_to_the_truth_than_odometry_and_nothing_is_blamed(kind, seed):
    log, truth = driven(kind, seed)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    assert checked.messages == []
    drive = map_drive(checked.log, SlamOptions())
    assert drive.messages == []
    assert log.odometry is not None
    assert rms(drive.graph.poses, truth) < rms(log.odometry, truth)


def test_loops_in_the_next_aisle_are_given_up(monkeypatch):
    """They agree with each other. Measured: 0.008 m; 4.2 m with them."""
    log, truth = driven("warehouse: 181", 2)
    assert rms(map_drive(log, SlamOptions()).graph.poses, truth) < 0.05
    monkeypatch.setattr(pipeline, "mend_contradicting_loops", lambda _: None)
    assert rms(map_drive(log, SlamOptions()).graph.poses, truth) > 1.0


def test_without_odometry_they_are_given_up_where_visits_contradict_each_other():
    """Measured: 0.03 m; 3.4 m with them."""
    log, truth = driven("warehouse: 181", 2)
    alone = replace(log, odometry=None, odometry_path=None)
    assert rms(map_drive(alone, SlamOptions()).graph.poses, truth) < 0.1


def test_scans_of_a_few_points_are_left_to_odometry():
    """Measured: 0.37 m, odometry 0.50 m; 2.2 m if they are matched."""
    log, truth = driven("grounds: 64", 2)
    options = SlamOptions()
    all_matched = replace(options, tracking=replace(options.tracking, min_points=0))
    left, matched = (rms(map_drive(log, each).graph.poses, truth) for each in (options, all_matched))
    assert log.odometry is not None
    assert left < rms(log.odometry, truth) < matched


def test_before_one_wall_a_narrow_view_tells_the_turn_alone():
    """What comes into view would be drawn back along the wall to where the view ended."""
    plan = Builder()
    plan.line(3.0, -30.0, 3.0, 30.0)
    view = np.radians(60)
    laser = Laser(241, -view / 2, view / 240, 20.0, noise=0.01, resolution=0.001, mount=(0.0, 0.0, 0.0))
    truth = np.stack([np.zeros(40), np.zeros(40), np.linspace(-0.4, 0.4, 40)], axis=1)
    scene = Scene("wall", plan.world(), truth[:, :2], Drive(period=0.1), laser)
    log = scene.record_at(truth, 1).log()
    rows, options = np.arange(0, 30, 3), FileCheckOptions().steps
    steps = measure_steps(log, (rows, rows + 8), options, turns_alone=True)
    assert len(steps) >= 6
    assert not steps.tell_places(options).any()
    off = wrap(steps.laser[:, 2] - relative(truth[steps.last], truth[steps.first])[:, 2])
    assert np.abs(off).max() < 0.01
    assert len(measure_steps(log, (rows, rows + 8), options)) == 0
