"""Steps of the robot by its scans alone, also where these see little of the same, as outdoors."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.measured_steps import measure_steps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.poses import relative
from tests.benchmarks.laser_kinds import HARD, recorded
from tests.calibration.test_file_check import found
from tests.data import data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults

Fault = Callable[[LaserLog], LaserLog]

OUTDOORS: dict[str, tuple[Fault, str]] = {
    "mirrored": (faults.mirrored, "in the wrong order.* try --flip"),
    "looks 90° left": (lambda log: faults.mounted_otherwise(log, -np.pi / 2), "9[01]° further to the left"),
    "millimetres": (lambda log: odometry_faults.scaled(log, 1000.0), "as by --odometry-scale 0.001"),
    "a third too long": (lambda log: odometry_faults.scaled(log, 1.33), r"try --odometry-scale 0\.7"),
    "x": (odometry_faults.x_reversed, "counts x or y the wrong way"),
    "held": (
        lambda log: odometry_faults.held(log, slice(3000, 5000), True),
        "stands still while the scans move",
    ),
}


@pytest.mark.parametrize("fault", OUTDOORS)
def test_outdoors_where_scans_tell_few_steps_more_are_measured(fault):
    make, words = OUTDOORS[fault]
    said = found(make(read_log(str(data_file("fr-clinic.log.gz")))))
    assert re.search(words, " ".join(said))


@pytest.mark.parametrize("fault", [name for name in OUTDOORS if name != "held"])
def test_scans_a_metre_apart_are_matched_by_a_search(fault):
    """Of 116 steps of this log, 21 can be measured from where the robot was, and 54 with a search."""
    make, words = OUTDOORS[fault]
    log = read_log(str(data_file("fr-campus.log.gz")))
    for some in (slice(None), slice(300, 900)):
        assert re.search(words, " ".join(found(make(excerpt(log, some)))))


def test_a_fast_robot_on_simulated_grounds():
    """Its scans are a metre apart, and the steps that a search finds are right."""
    grounds = next(kind for kind in HARD if kind.name.startswith("grounds"))
    log, truth = recorded(grounds, 1, "good")
    fast = slice(None, None, 5)
    log, truth = excerpt(log, fast), truth[fast]
    log = replace(log, times=log.times[0] + np.arange(len(log)))
    rows = np.arange(0, len(log) - 1, 10)
    options = FileCheckOptions().steps
    without = replace(options, min_searched_overlap=1.0)
    steps = measure_steps(log, (rows, rows + 1), options)
    assert len(steps) > 1.5 * len(measure_steps(log, (rows, rows + 1), without))
    true = relative(truth[steps.last], truth[steps.first])
    off = np.hypot(*(steps.odometry(truth) - steps.laser)[:, :2].T)
    assert (off < 0.1 + 0.1 * np.hypot(*true[:, :2].T)).mean() >= 0.9


@pytest.mark.parametrize("fault", [faults.mirrored, lambda log: odometry_faults.turning(log, 0.0)])
def test_a_drive_with_few_turns(fault):
    """Where the few are all opposite, or odometry never turns, more are measured, and fewer are enough."""
    log = excerpt(read_log(str(data_file("fr-clinic.log.gz"))), slice(600, 1700))
    assert re.search("in the wrong order|likely turns wrongly", " ".join(found(fault(log))))
    assert found(log) == []
