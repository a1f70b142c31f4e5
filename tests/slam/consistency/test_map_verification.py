"""A drive mapped again: what is the same where the map is right, and differs where it is silently wrong."""

from __future__ import annotations

import functools
import json
from typing import Any

from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.consistency.map_verification import add_verification
from nscan_cli.slam.consistency.options import VerificationOptions
from nscan_cli.slam.log_to_graph import map_log
from nscan_cli.slam.options import SlamOptions
from tests.data import CORRIDOR_LOG, OFFICE_LOG, data_file


@functools.cache
def provenance(path: str, every: int = 1, threads: int = 1) -> dict[str, Any]:
    reading = ReadingOptions(every=every)
    state, graph = map_log(read_log(path, reading), reading, SlamOptions(), threads, lambda *_counts: None)
    add_verification(state, graph, VerificationOptions(), threads)
    return graph.provenance


def test_a_sound_map_stays_the_same():
    found = provenance(OFFICE_LOG, every=2)
    names = [run["change"] for run in found["verification"]["repeats"]]
    assert names == ["every second scan", "the other scans", "mirrored", "without odometry"]
    assert found["verification"]["greatest"] < 0.2
    assert not any("mapped again" in notice for notice in found["notices"])
    assert found["parameters"]["verification"]["max_difference"] == 0.3


def test_a_repeat_that_guesses_where_the_map_knows_is_not_believed():
    """Without odometry the sample begins in a bare corridor as if it stood: 0.4 m."""
    found = provenance(CORRIDOR_LOG)
    assert found["verification"]["greatest"] < 0.1
    assert not any("mapped again" in notice for notice in found["notices"])


def test_the_result_does_not_depend_on_threads():
    one, two = (provenance(OFFICE_LOG, every=8, threads=threads)["verification"] for threads in (1, 2))
    assert json.dumps(one) == json.dumps(two)


def test_a_map_that_is_silently_wrong_is_shown():
    """rplidar-hallway has no odometry: with every second scan the hallway is 0.8 m longer."""
    found = provenance(str(data_file("field/rplidar-hallway.bag")))
    assert found["verification"]["greatest"] > 0.5
    notices = found["notices"]
    assert any(each.startswith("mapped again (every second scan), the map differs by 0.") for each in notices)
    worst = max(
        (each for run in found["verification"]["repeats"] for each in run["differences"]),
        key=lambda each: each["max"],
    )
    # And sigma knows: it was 0.04 m.
    assert worst["sigma"] > 0.5 * worst["max"]
