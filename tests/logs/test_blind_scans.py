"""Stretches in which the laser sees nothing are named."""

from __future__ import annotations

import numpy as np

from nscan_cli.logs.blind_scans import BlindScanOptions, blind_scans

LEAST = BlindScanOptions()


def ranges(blind: slice, reading: float = np.nan) -> np.ndarray:
    found = np.full((60, 20), 2.0, dtype=np.float32)
    found[blind] = reading
    return found


def test_stretches_of_some_scans_are_named():
    for reading in (np.nan, np.inf):
        (said,) = blind_scans(ranges(slice(20, 40), reading), np.arange(60) + 100)
        assert said.startswith("the laser sees nothing from scan 120 to 139: odometry alone")


def test_a_few_scans_and_a_quarter_of_the_beams_are_usual():
    numbers = np.arange(60)
    assert blind_scans(ranges(slice(20, 20 + LEAST.min_scans - 1)), numbers) == []
    seen = ranges(slice(20, 40))
    seen[:, 7:12] = 3.0
    assert blind_scans(seen, numbers) == []


def test_so_are_stretches_with_a_few_returns():
    seen = ranges(slice(20, 40))
    seen[:, 7:11] = 3.0
    (said,) = blind_scans(seen, np.arange(60))
    assert said.startswith("the laser has less than 5 returns from scan 20 to 39: odometry alone")
