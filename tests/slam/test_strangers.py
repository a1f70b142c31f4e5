"""Recordings whose file is wrong about odometry, simulated after public reports: what the map is like."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest

from nscan_cli.graph.io.tum import parse_tum
from nscan_cli.graph.model import Graph
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.log_to_graph import map_log
from nscan_cli.slam.options import SlamOptions
from tests.data import data_file
from tests.slam.mapped_logs import position_rmse

OFFICE = "office-900.tum"
UNTOUCHED, SHORT_SIGHTED = 0.0027, 0.0137
"""ATE RMSE of the drive as it was, with a laser of 12 m and of 4 m, m."""
AS_RECORDED = ReadingOptions(as_recorded=True)


def truth(name: str) -> np.ndarray:
    """(S, 3) the true poses."""
    found = parse_tum(data_file(f"strangers/{name}").read_bytes(), name)
    return found.poses


@functools.cache
def mapped_file(name: str, reading: ReadingOptions = ReadingOptions()) -> Graph:
    log = read_log(str(data_file(f"strangers/{name}")), reading)
    return map_log(log, reading, SlamOptions(), 1, lambda *_progress: None)[1]


def error(name: str, reference: str, reading: ReadingOptions = ReadingOptions()) -> float:
    """ATE RMSE of a recording, m."""
    found = mapped_file(name, reading).poses
    return position_rmse(found, truth(reference)[: len(found)])


def test_a_gap_of_the_odometry_is_no_straight_line():
    """Drawn straight it was 4.03 m."""
    assert error("odometry-gap.mcap", OFFICE) < 1.5 * SHORT_SIGHTED


def test_where_odometry_ends_is_said():
    log = read_log(str(data_file("strangers/corridor-odometry-ends.mcap")))
    (warning,) = log.report.warnings
    assert warning.startswith("odometry is missing at 180 scans")
    assert "scans 183 to 362" in warning


def test_odometry_that_never_moves_is_not_used():
    """Believed, it was 2.78 m."""
    assert error("odometry-frozen.mcap", OFFICE) < 1.5 * SHORT_SIGHTED
    graph = mapped_file("odometry-frozen.mcap")
    assert graph.odometry is None
    assert graph.provenance["parameters"]["reading"]["odometry"] is False
    assert graph.provenance["notices"][0].startswith("odometry never moves")
    assert error("odometry-frozen.mcap", OFFICE, AS_RECORDED) > 1.0


def test_millimetres_are_metres():
    assert error("odometry-millimetres.mcap", OFFICE) < 1.5 * UNTOUCHED
    graph = mapped_file("odometry-millimetres.mcap")
    assert graph.provenance["parameters"]["reading"]["odometry_scale"] == 0.001
    assert graph.odometry is not None
    assert np.abs(graph.odometry).max() < 100.0


@pytest.mark.parametrize(
    ("name", "reference", "cause", "cure"),
    [
        ("mirrored.mcap", OFFICE, "readings are likely in the wrong order", "--flip"),
        ("mount-wrong-90.mcap", "office-600.tum", "looks 90° further to the left", "--mount 0.2,0,90"),
    ],
)
def test_what_is_likely_is_cured_by_the_option_in_the_message(name, reference, cause, cure):
    (message,) = mapped_file(name).provenance["notices"]
    assert cause in message
    assert f"try {cure}" in message
    flip, mount = cure == "--flip", (0.2, 0.0, np.pi / 2) if "--mount" in cure else None
    assert error(name, reference, ReadingOptions(flip=flip, mount=mount)) < 1.5 * UNTOUCHED
    assert mapped_file(name, ReadingOptions(flip=flip, mount=mount)).provenance["notices"] == []


def test_two_clocks_are_told_apart():
    log = read_log(str(data_file("strangers/two-clocks.mcap")))
    assert log.odometry is None
    (cure,) = re.findall(r"--clock-offset (\S+) corrects", " ".join(log.report.warnings))
    log = read_log(str(data_file("strangers/two-clocks.mcap")), ReadingOptions(clock_offset=float(cure)))
    assert log.odometry is not None
    assert log.report.warnings == ()
