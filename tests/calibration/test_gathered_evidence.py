"""How many steps are measured: few where all is well, and each once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from nscan_cli.calibration import measured_steps
from nscan_cli.calibration.contradictions import find_contradictions
from nscan_cli.calibration.measured_steps import KnownSteps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.thinned_scans import ThinnedScan, thinned_scan
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file
from tests.simulation import odometry_faults
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
