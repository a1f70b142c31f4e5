"""The field of view is that of scans' own beams, and beams that a scan does not have are not lost."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.field_of_view import beams_lost, field_of_view
from tests.logs import lines
from tests.logs.recordings.messages import PERIOD, START, Scan, Written

COUNTS = (240, 602, 452, 300)


def turns(counts: tuple[int, ...]) -> list[Written]:
    """Whole turns of a laser with as many beams each, a tenth of which say nothing."""
    written = []
    for k, count in enumerate(counts):
        ranges = np.full(count, 2.0 + k, dtype=np.float32)
        ranges[: count // 10] = math.nan
        scan = Scan(START + k * PERIOD, ranges, "base_link", 0.0, 2 * math.pi / (count - 1), 0.02, 25.0)
        written.append(Written("/scan", START + k * PERIOD, scan))
    return written


@pytest.mark.parametrize("counts", [COUNTS, COUNTS[::-1], (360, 360)])
def test_scans_of_different_lengths(read, counts):
    log = read(turns(counts))
    assert log.beam_counts().tolist() == list(counts)
    first, last, step = (math.degrees(angle) for angle in field_of_view(log))
    assert (first, last) == pytest.approx((0, 360), abs=1e-4)
    assert 360 / 601 - 1e-6 <= step <= 360 / 239 + 1e-6
    unusable = sum(count // 10 for count in counts) / sum(counts)
    assert list(beams_lost(log)) == pytest.approx([0.0, unusable])
    assert log.readings(0).tolist()[-1] == 2.0
    assert len(log.readings(1)) == counts[1]


def test_shorter_records_of_a_text_log(tmp_path):
    log = lines.read(tmp_path, lines.flaser(1, (1.0,) * 181), lines.flaser(2, (1.0, 81.91) + (2.0,) * 88))
    first, last, step = (math.degrees(angle) for angle in field_of_view(log))
    assert (first, last, step) == pytest.approx((-90, 90, 1))
    assert list(beams_lost(log)) == pytest.approx([1 / 271, 0.0])
