"""Ways without odometry whose length no scan tells."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.load import read_log
from nscan_cli.logs.log_excerpt import excerpt
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.backend.degenerate_relations import degenerate_stretches
from nscan_cli.slam.backend.options import DegenerateStretchOptions
from nscan_cli.slam.diagnostics.notices import notices
from tests.data import data_file
from tests.slam.frontend.test_degeneracy import into_a_bare_corridor
from tests.slam.frontend.test_lost_scans import across_a_yard
from tests.slam.frontend.test_tracker import straight_corridor
from tests.slam.mapped_logs import mapped, office_log

OPTIONS = DegenerateStretchOptions()
STEP = 0.1
"""m"""


@given(st.integers(1, 20), st.integers(10, 40), st.integers(0, 4))
def test_a_way_is_named_that_is_long_enough(first, count, between):
    """Some scans in it that seem to tell more do not divide it."""
    sigmas, poses = np.zeros(80), np.zeros((80, 3))
    poses[:, 0] = STEP * np.arange(80)
    last = first + count
    sigmas[first : last + 1] = 0.3
    middle = first + count // 2
    sigmas[middle : middle + between] = 0.01
    ways = degenerate_stretches(poses, np.arange(80.0), sigmas, OPTIONS)
    if between <= OPTIONS.scans_between:
        long_enough = STEP * (count + 1) >= OPTIONS.path - 1e-9
        assert len(ways) == (1 if long_enough else 0) or abs(STEP * (count + 1) - OPTIONS.path) < 1e-6
        for way in ways:
            assert (way.first, way.last) == (first, last)
            assert way.path == pytest.approx(STEP * (count + 1))
    assert all(way.path >= OPTIONS.path for way in ways)


def test_a_way_is_named_where_the_robot_only_seems_to_stand():
    """It drives at 0.5 m/s, and seems to stand for six seconds in which no scan tells its place."""
    steps, sigmas = np.full(120, 0.05), np.zeros(120)
    steps[20:80], sigmas[20:80] = 0.0, 0.3
    poses = np.zeros((120, 3))
    poses[:, 0] = np.cumsum(steps)
    (way,) = degenerate_stretches(poses, 0.1 * np.arange(120.0), sigmas, OPTIONS)
    assert (way.first, way.last) == (20, 79)
    assert way.path == pytest.approx(0.0)
    assert way.possible == pytest.approx(3.0)
    assert not way.is_long(OPTIONS)


@pytest.mark.parametrize("seed", [4, 5])
def test_a_bare_corridor_is_told(seed):
    """After 16 m with piers come 12 m without any."""
    said = "\n".join(notices(mapped(into_a_bare_corridor(seed)).state))
    assert "do not show how far the robot went" in said


def test_a_corridor_with_piers_and_an_office_are_not_told():
    for log in (straight_corridor(scenery=True), office_log()):
        said = "\n".join(notices(mapped(dataclasses.replace(log, odometry=None)).state))
        assert "do not show" not in said


def test_the_hallway_of_a_real_recording_is_told():
    log = read_log(str(data_file("field/rplidar-hallway.bag")), ReadingOptions(odometry=False))
    said = "\n".join(notices(mapped(log).state))
    told = re.search(r"how far the robot went: ([\d.]+) m from scan (\d+) to (\d+)", said)
    assert told is not None
    assert float(told[1]) > 2.0
    assert 270 < int(told[2]) < int(told[3]) < 360


@pytest.mark.parametrize("every", [1, 3])
def test_a_recording_that_begins_while_the_robot_drives_along_bare_walls_is_told(every):
    """Nothing tells how fast it drives: its first 5 s came out between 1 and 3 m long, without a word."""
    log = read_log(str(data_file("field/rplidar-hallway.bag")), ReadingOptions(odometry=False))
    rows = np.arange(len(log) // 3, 2 * len(log) // 3, every)
    said = "\n".join(notices(mapped(excerpt(log, rows)).state))
    told = re.search(r"how far the robot went: .* from scan (\d+) to", said)
    assert told is not None
    assert int(told[1]) < rows[0] + 20


def test_a_laser_that_sees_next_to_nothing_is_told():
    """The robot seemed to stand, without a word."""
    said = notices(mapped(dataclasses.replace(across_a_yard(4.0, 1), truth=None)).state)
    assert any(notice.startswith("no match for 99 scans of 100") for notice in said)
    said = notices(mapped(dataclasses.replace(across_a_yard(1.0, 1), truth=None)).state)
    assert said == []
