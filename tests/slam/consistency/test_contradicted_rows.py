"""Scans that fit where the map has them, and not where a repeat puts them."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.consistency.contradicted_rows import contradicted_rows
from nscan_cli.slam.consistency.options import VerificationOptions
from nscan_cli.slam.consistency.path_differences import path_differences
from nscan_cli.slam.consistency.repeated_maps import MappedPath
from tests.logs.excerpts import excerpt
from tests.simulation.scenes import office

OPTIONS = VerificationOptions()


@pytest.fixture(scope="module")
def drive() -> tuple[LaserLog, Array]:
    """A simulated drive and its true path."""
    log = excerpt(office().record(3).log(), slice(0, 200))
    assert log.truth is not None
    return log, log.truth[:200]


def mapped(poses: Array) -> MappedPath:
    none = np.zeros(0, dtype=np.int64)
    return MappedPath(np.arange(len(poses)), poses, none, ())


def test_a_scan_where_it_does_not_fit_is_found(drive):
    log, truth = drive
    wrong = truth.copy()
    wrong[120, :2] += 0.4
    assert contradicted_rows(log, mapped(truth), mapped(wrong), OPTIONS).tolist() == [120]


def test_a_turn_by_which_the_repeat_is_off_is_found(drive):
    log, truth = drive
    wrong = truth.copy()
    # All that comes behind turns with it.
    wrong[100:] = compose(compose(truth[100], np.array([0.0, 0.0, 0.1])), relative(truth[100:], truth[100]))
    found = contradicted_rows(log, mapped(truth), mapped(wrong), OPTIONS)
    assert {99, 100} & set(found.tolist())
    assert np.abs(found - 100).max() < 60


def test_equal_paths_and_a_wrong_map_are_not_excused(drive):
    log, truth = drive
    wrong = truth.copy()
    wrong[120, :2] += 0.4
    assert contradicted_rows(log, mapped(truth), mapped(truth), OPTIONS).tolist() == []
    assert contradicted_rows(log, mapped(wrong), mapped(truth), OPTIONS).tolist() == []


def test_a_bound_that_nothing_exceeds_finds_nothing(drive):
    log, truth = drive
    wrong = truth.copy()
    wrong[120, :2] += 0.4
    options = VerificationOptions(min_gain=100.0)
    assert contradicted_rows(log, mapped(truth), mapped(wrong), options).tolist() == []


def test_ways_over_such_a_scan_say_nothing(drive):
    _, truth = drive
    wrong = truth.copy()
    wrong[100:, :2] += 0.4
    repeat = mapped(wrong)
    ways = VerificationOptions(ways=(1.0,))
    assert path_differences(mapped(truth), repeat, ways)[0].max > 0.3
    excused = MappedPath(repeat.rows, wrong, repeat.breaks, (), contradicted=np.array([100]))
    assert path_differences(mapped(truth), excused, ways)[0].max < 1e-9
