"""Recordings whose file is wrong about odometry, simulated after public reports: what the map is like."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from nscan_cli.graph.io.tum import parse_tum
from nscan_cli.logs.load import read_log
from tests.data import data_file
from tests.slam.mapped_logs import Mapped, mapped, position_rmse

OFFICE = "office-900.tum"
UNTOUCHED = 0.0137
"""ATE RMSE of the drive with a laser of 4 m and its odometry, m."""


def truth(name: str) -> np.ndarray:
    """(S, 3) the true poses."""
    found = parse_tum(data_file(f"strangers/{name}").read_bytes(), name)
    return found.poses


@functools.cache
def mapped_file(path: Path) -> Mapped:
    return mapped(read_log(str(path)))


def error(name: str, reference: str) -> float:
    """ATE RMSE of a recording, m."""
    found = mapped_file(data_file(f"strangers/{name}")).graph.poses
    return position_rmse(found, truth(reference)[: len(found)])


def test_a_gap_of_the_odometry_is_no_straight_line():
    """Drawn straight it was 4.03 m."""
    assert error("odometry-gap.mcap", OFFICE) < 1.5 * UNTOUCHED


def test_where_odometry_ends_is_said():
    found = mapped_file(data_file("strangers/corridor-odometry-ends.mcap"))
    (warning,) = found.log.report.warnings
    assert warning.startswith("odometry is missing at 180 scans")
    assert "scans 183 to 362" in warning
