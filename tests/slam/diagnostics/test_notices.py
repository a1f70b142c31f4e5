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
from tests.slam.mapped_logs import mapped, position_rmse
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
def test_a_way_beside_glass_is_told_to_be_a_guess(seed):
    """The map is right; the robot has driven steadily."""
    recording = round_scene().record(seed)
    made = without_odometry(ROUND["glass wall, seen within 17° of head-on"](recording.log()))
    run = mapped(made.log)
    assert position_rmse(run.graph.poses, recording.truth) < 0.1
    (said,) = notices(run.state)
    told = re.match(
        r"the walls do not show how far the robot went: ([\d.]+) m from scan (\d+) to (\d+)", said
    )
    assert told is not None
    assert 3 < float(told[1]) < 7
    assert 150 < int(told[2]) < int(told[3]) < 200


@pytest.mark.parametrize("seed", range(4, 9))
def test_someone_who_walks_along_does_not_hold_the_robot(seed):
    """Half of all beams end on someone near the robot; they are a few points of many."""
    recording = round_scene().record(seed)
    run = mapped(ROUND["someone who walks along"](recording.log()).log)
    assert position_rmse(run.graph.poses, recording.truth) < 0.01
    assert all("look different" in said for said in notices(run.state))


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
    # The last 0.8 m of the 3 m back are driven twice.
    assert 3.4 < by_odometry - by_scans < 6.0
    assert first <= 1375 <= 1431 <= last
