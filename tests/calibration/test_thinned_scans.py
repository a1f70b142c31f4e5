"""Scans as they are matched by the check of a file."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.calibration.thinned_scans import thinned_scan
from tests.slam.mapped_logs import office_log


@pytest.mark.parametrize(("beams", "returned", "kept"), [
    (1080, 1080, 180), (1080, 1000, 167), (1080, 400, 134), (1080, 150, 150), (540, 520, 174), (180, 90, 90),
])  # fmt: skip
def test_where_few_beams_return_fewer_are_left_out(beams, returned, kept):
    """Of 540 beams outdoors, of which 150 return, 50 were matched, and no match was believed."""
    log = office_log()
    ranges = np.full((1, beams), np.inf, dtype=np.float32)
    ranges[0, :returned] = 5.0
    log = dataclasses.replace(log, ranges=ranges)
    scan = thinned_scan(log, 0, StepOptions())
    assert scan is not None
    assert len(scan.points) == len(scan.beams) == kept
