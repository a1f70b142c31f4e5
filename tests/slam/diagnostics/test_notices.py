"""What a user is told of the way that a log was mapped."""

from __future__ import annotations

import functools
import json
import re

import numpy as np
import pytest

from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.log_to_graph import map_log
from nscan_cli.slam.options import SlamOptions
from tests.data import data_file
from tests.slam.keyframe_drives import round_scene
from tests.slam.mapped_logs import mapped
from tests.slam.trouble_cases import ROUND, without_odometry


@functools.cache
def simulated() -> LaserLog:
    return round_scene().record(5).log()


@pytest.mark.parametrize(
    ("trouble", "odometry", "told"),
    [
        (
            "3 s of scans dropped",
            True,
            r"scans are missing before scan 187: by odometry the robot moved more than 2 m or 1 rad there",
        ),
        (
            "laser frozen for 8 m",
            False,
            r"repeats itself at scans 187, .* it is frozen, or the robot stands still; .*\n"
            r"places look different",
        ),
    ],
)
def test_trouble_that_the_graph_hides_is_told(trouble, odometry, told):
    made = ROUND[trouble](simulated())
    said = notices(mapped((made if odometry else without_odometry(made)).log).state)
    assert re.search(rf"{told}.*\Z", "\n".join(said))


@pytest.mark.parametrize("seed", [5, 6, 7, 8])
def test_a_map_that_a_glass_wall_has_made_6_m_too_short_is_told(seed):
    """Tracking stands still beside the glass, and in the other corridor the visits match, 6 m off."""
    drive = round_scene().record(seed).log()
    made = without_odometry(ROUND["glass wall, seen within 17° of head-on"](drive))
    said = "\n".join(notices(mapped(made.log).state))
    told = re.search(r"another visit: from scan (\d+) to (\d+), its beams pass through ([\d.]+)%", said)
    assert told is not None
    assert 270 <= int(told[1]) < int(told[2])
    assert float(told[3]) >= 25


@pytest.mark.parametrize("seed", [4, 5, 6, 7])
def test_of_someone_who_walks_along_it_is_told_that_odometry_and_scans_disagree(seed):
    """On some drives tracking breaks before, or relations contradict each other behind."""
    log = ROUND["someone who walks along"](round_scene().record(seed).log()).log
    ways = r"disagree about the distance driven: 1\d\.\d m and \d\.\d m from scan (\d+) to (\d+)"
    told = re.search(ways, "\n".join(notices(mapped(log).state)))
    assert told is not None
    assert int(told[1]) < 40
    assert int(told[2]) > 60


def test_of_someone_who_walks_along_it_is_told_too_where_tracking_breaks_before():
    log = ROUND["someone who walks along"](round_scene().record(8).log()).log
    said = notices(mapped(log).state)
    assert said[0].startswith("tracking broke at scan 28;")
    assert "disagree about the distance driven: 9.3 m and 1.8 m from scan 28 to 70" in said[1]


@pytest.mark.parametrize("trouble", ["none", "people who pass"])
@pytest.mark.parametrize("odometry", [True, False])
def test_of_a_sound_drive_there_is_nothing_to_tell(odometry, trouble):
    made = ROUND[trouble](simulated())
    assert notices(mapped((made if odometry else without_odometry(made)).log).state) == []


def test_the_graph_keeps_what_was_told():
    log = ROUND["carried by 5 m"](simulated()).log
    _, graph = map_log(log, ReadingOptions(), SlamOptions(), 1, lambda *done: None)
    told = json.loads(write_graph(graph))["provenance"]["notices"]
    assert [re.sub(r"\d+", "n", notice) for notice in told] == [
        "tracking broke at scan n; how the robot moved there is unknown"
    ]


def test_odometry_without_sign_in_a_real_log_is_told():
    """fr079 goes 4 m ahead and 3 m back about scan 1400; its odometry says ahead all the way."""
    log = read_log(str(data_file("fr079.log.gz")), ReadingOptions(start=0.0, end=400.0))
    (told,) = notices(mapped(log).state)
    lengths = re.search(
        r"disagree about the distance driven: (\S+) m and (\S+) m from scan (\d+) to (\d+)", told
    )
    assert lengths is not None
    by_odometry, by_scans, first, last = map(float, lengths.groups())
    assert log.odometry is not None
    ahead = np.linalg.norm(log.odometry[int(last), :2] - log.odometry[int(first), :2])
    assert by_odometry == pytest.approx(ahead, rel=0.02)
    assert by_odometry - by_scans == pytest.approx(3.9, abs=0.5)
    assert first <= 1375 <= 1431 <= last
