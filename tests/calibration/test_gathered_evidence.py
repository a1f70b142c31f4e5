"""How many steps are measured: few where all is well, and each once."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from nscan_cli.calibration import measured_steps
from nscan_cli.calibration.contradictions import find_contradictions
from nscan_cli.calibration.measured_steps import KnownSteps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.thinned_scans import ThinnedScan, thinned_scan
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults
from tests.slam.keyframe_drives import round_scene


def measured(log: LaserLog, options: FileCheckOptions) -> KnownSteps:
    known: KnownSteps = {}
    find_contradictions(log, ReadingOptions(), options, known)
    return known


def test_steps_are_measured_once(monkeypatch):
    """Those in doubt, and those that tell the clock, are from a larger sample of the same log."""
    scans = []

    def counted(*given: Any) -> ThinnedScan | None:
        scans.append(given)
        return thinned_scan(*given)

    monkeypatch.setattr(measured_steps, "thinned_scan", counted)
    late = odometry_faults.late(round_scene().record(5).log(), 3.0)
    known = measured(late, FileCheckOptions())
    assert len(known) > 2 * FileCheckOptions().steps.count
    assert 0 < len(scans) <= 2 * len(known)


def test_an_offset_by_chance_is_not_followed():
    late = odometry_faults.late(round_scene().record(5).log(), 3.0)
    options = FileCheckOptions()
    never = replace(options, clock=replace(options.clock, first_gain=0.0))
    assert any(each.is_of_clocks for each in find_contradictions(late, ReadingOptions(), options))
    assert not any(each.is_of_clocks for each in find_contradictions(late, ReadingOptions(), never))
    assert len(measured(late, never)) < len(measured(late, options))


def test_a_doubt_that_is_settled_is_measured_no_further():
    log, options = read_log(str(data_file("field/urg-corridor-2.bag"))), FileCheckOptions()
    assert len(measured(log, options)) < 0.8 * len(measured(log, replace(options, more_parts=1)))


def along_corridors() -> LaserLog:
    """A drive with eleven turns among the first steps."""
    return excerpt(read_log(str(data_file("mit-killian.log.gz"))), slice(2000, 3800))


def test_turns_are_told_where_few_of_the_first_steps_turn():
    for rows in (slice(1500, 3300), slice(4200, 5600)):
        log = excerpt(read_log(str(data_file("fr-clinic.log.gz"))), rows)
        assert told(log) == []
        (said,) = told(odometry_faults.turning(log, 2.0))
        assert re.search(r"turns by odometry are (1\.9\d?|2|2\.\d\d?) times", said)


def test_so_is_a_clock():
    assert told(along_corridors()) == []
    (said,) = told(odometry_faults.late(along_corridors(), 12.0))
    assert re.search(r"clock of odometry is likely 1[12]\.\d s ahead", said)


def test_small_motion_in_ranges_that_are_too_short_is_motion():
    """Two thirds of the steps are shorter than 0.05 m then: the laser was said to be covered."""
    (said,) = told(faults.ranges_scaled(along_corridors(), 0.3048, slice(None)))
    found = re.search(r"one metre by odometry is (0\.\d+) m", said)
    assert found is not None
    assert float(found[1]) == pytest.approx(0.3048, rel=0.12)


def told(log: LaserLog) -> list[str]:
    return [found.message for found in find_contradictions(log, ReadingOptions(), FileCheckOptions())]
