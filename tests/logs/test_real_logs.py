"""The reader on real logs; figures are those of the logs' own description, or counted with awk."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.load import read_log
from tests.data import data_file

pytestmark = pytest.mark.logs


@pytest.mark.parametrize(
    ("name", "scans", "beams", "seconds", "no_return", "lost", "backward"),
    [
        ("intel", 13631, 180, 2691, 81.83, 68313, 631),
        ("fr079", 4934, 360, 1061, 81.91, 36881, 0),
        ("mit-csail", 1988, 361, 424, 81.91, 23711, 0),
        # 39,739 readings of 51.05 to 51.22: one value of a laser with 5 cm steps, spread by its conversion.
        ("mit-killian", 17480, 180, 7677, 51.05, 39739, 0),
        # 184,330 readings of 81.91 and 2,704 of 81.83; 307 more lie beyond CARMEN's 80 m.
        ("fr-campus", 2008, 360, 1760.5, 81.83, 187341, 0),
    ],
)
def test_real_log(name, scans, beams, seconds, no_return, lost, backward):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert log.ranges.shape == (scans, beams)
    assert log.numbers.tolist() == list(range(scans))
    assert log.times[-1] - log.times[0] == pytest.approx(seconds, abs=0.6)
    assert log.no_return == pytest.approx(no_return, abs=1e-3)
    assert np.isinf(log.ranges).sum() == lost
    assert not np.isnan(log.ranges).any()
    assert log.report.backward_stamps == backward
    assert log.report.skipped == {}
    assert log.report.records["FLASER"] == scans
    assert log.odometry is not None
    assert log.odometry.shape == (scans, 3)
    step = {180: 1.0, 360: 0.5, 361: 0.5}[beams]
    assert math.degrees(log.angle_increment[0]) == pytest.approx(step)


def test_fr079_laser_is_behind_the_centre_and_param_agrees():
    log = read_log(str(data_file("fr079.log.gz")))
    np.testing.assert_allclose(log.mount, (-0.04, 0, 0), atol=1e-5)
    assert log.report.warnings == ()


def test_stamps_of_the_relations_occur_in_the_log():
    log = read_log(str(data_file("intel.log.gz")))
    stamps = np.loadtxt(data_file("intel.relations"), usecols=(0, 1)).ravel()
    nearest = np.searchsorted(log.times, stamps).clip(1, len(log) - 1)
    off = np.minimum(np.abs(log.times[nearest] - stamps), np.abs(log.times[nearest - 1] - stamps))
    assert off.max() < 1e-5
