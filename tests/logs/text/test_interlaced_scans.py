"""Interlaced scans of a SICK: 180 readings that lie between the 181 of the scan before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nscan_cli.logs.text.interlaced_scans import between_the_others
from tests.logs.lines import read

DEGREE = np.pi / 180


def record(beams: int, k: int) -> str:
    """A ROBOTLASER1 record whose head has the same first direction whatever the number of beams."""
    head = f"ROBOTLASER1 4 -1.570796 {(beams - 1) * DEGREE:.6f} 0.017453 81.92 0.01 0 {beams}"
    pose = f"{0.1 * k} 0 0 {0.1 * k} 0 0"
    return f"{head} {' '.join(['5.0'] * beams)} 0 {pose} 0 0 0 0 0 {k}.0 h {k}.0"


def test_short_scans_begin_half_a_step_later(tmp_path: Path) -> None:
    log = read(tmp_path, *(record(181 - k % 2, k) for k in range(20)))
    first = np.degrees(log.angle_min)
    assert first[::2] == pytest.approx(-90, abs=0.01)
    assert first[1::2] == pytest.approx(-89.5, abs=0.01)
    assert "10 scans of 20 have 180 readings" in log.report.used["beams"]


@pytest.mark.parametrize("beams", [[180] * 40, [181] * 39 + [180], [181, 179] * 20, [181, 180, 90] * 20])
def test_other_logs_are_read_as_recorded(beams: list[int]) -> None:
    """All alike, one damaged scan, scans two readings shorter, and scans of a third length."""
    n = len(beams)
    assert not between_the_others(np.array(beams), np.full(n, -90.0), np.full(n, 1.0)).any()


def test_scans_that_say_where_they_begin_are_believed() -> None:
    beams, first = np.array([181, 180] * 20), np.array([-90.0, -89.5] * 20)
    assert not between_the_others(beams, first, np.ones(40)).any()
    assert between_the_others(beams, np.full(40, -90.0), np.ones(40)).sum() == 20
