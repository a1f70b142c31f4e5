"""Beams that always say exactly the same are left out, if the others change."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file
from tests.logs import lines
from tests.logs.noisy_room import BEAMS, SCANS, Readings, carmen, readings, recording

BEGINNING = "beams say exactly the same (5.00 m)"


def with_dead_beams(scans: int = SCANS) -> Readings:
    found = readings(scans)
    found[:, 20:40] = 5.0
    return found


def test_they_are_left_out_and_it_is_said(read):
    log = read(recording(with_dead_beams()))
    (said,) = log.report.contradictions
    assert said.startswith(BEGINNING)
    assert "--mask -141:-101" in said
    assert np.isnan(log.ranges[:, 20:40]).all()
    assert not np.isnan(np.delete(log.ranges, np.s_[20:40], axis=1)).any()


def test_a_text_log_is_read_so_and_options_decide(tmp_path):
    scans = carmen(with_dead_beams())
    said = lines.read(tmp_path, *scans).report.contradictions
    assert any(text.startswith(BEGINNING) for text in said)
    for options in (ReadingOptions(as_recorded=True), ReadingOptions(mask=((0.0, 0.1),))):
        log = lines.read(tmp_path, *scans, options=options)
        assert not any(text.startswith(BEGINNING) for text in log.report.contradictions)
        assert (log.ranges[:, 20:40] == 5.0).all()


def test_a_robot_that_stands_has_none(read):
    """A simulated laser without noise."""
    still = np.repeat(readings()[:1], SCANS, axis=0)
    assert not read(recording(still)).report.contradictions


def test_a_beam_that_meets_nothing_is_none(read):
    ranges = readings()
    ranges[:, 20:40] = 12.0
    assert not read(recording(ranges)).report.contradictions


def test_what_changes_for_a_tenth_of_the_scans_is_none(read):
    ranges = with_dead_beams()
    ranges[: SCANS // 10 + 1] = readings()[: SCANS // 10 + 1]
    assert not read(recording(ranges)).report.contradictions


def test_few_scans_tell_nothing(read):
    assert not read(recording(with_dead_beams(31))).report.contradictions


def test_most_beams_are_never_left_out(read):
    ranges = readings()
    ranges[:, : BEAMS // 2 + 1] = 5.0
    assert not read(recording(ranges)).report.masked


@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel", "mit-killian", "fr-campus", "fr-clinic"])
def test_real_logs_have_none(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert not any("exactly the same" in said for said in log.report.contradictions)
