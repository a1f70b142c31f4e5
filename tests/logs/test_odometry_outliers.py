"""Single wrong values of the odometry: steady motion takes their place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.load import read_log
from nscan_cli.logs.odometry_outliers import OdometryOutlierOptions, without_outliers
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import data_file
from tests.logs import lines
from tests.logs.lines import flaser
from tests.logs.noisy_room import readings, recording, way
from tests.logs.recordings.messages import Odom

BEGINNING = "odometry has"


def drive(poses: int = 200) -> tuple[Array, Array]:
    """Poses (S, 3) of an arc, far from the origin, and their times (S,), s."""
    turned = 0.01 * np.arange(poses)
    along = np.stack([20.0 + 5.0 * np.sin(turned), 10.0 - 5.0 * np.cos(turned), turned], axis=1)
    return along, 0.1 * np.arange(poses, dtype=np.float64)


@given(
    every=st.integers(12, 60),
    length=st.integers(1, 4),
    wrong=st.tuples(st.floats(-50.0, 10.0), st.floats(-50.0, 0.0), st.floats(-3.0, 3.0)),
)
def test_wrong_values_become_steady_motion(every, length, wrong):
    poses, times = drive()
    broken = poses.copy()
    for begin in range(5, len(poses) - 10, every):
        broken[begin : begin + length] = wrong
    found, said = without_outliers(broken, times)
    assert np.abs(found - poses).max() < 0.01
    assert said.startswith(BEGINNING)
    assert "all are" in said


def test_a_wrong_heading_is_found():
    poses, times = drive()
    broken = poses.copy()
    broken[50, 2] += 2.0
    found, said = without_outliers(broken, times)
    assert np.abs(found - poses).max() < 0.01
    assert said.startswith("odometry has 1 single wrong value,")
    assert "5.0 s after the beginning" in said


@pytest.mark.parametrize("wrong", [(0.4, 0.0, 0.0), (-0.2, 0.3, 0.0), (0.0, 0.0, 0.4)])
def test_a_single_value_is_found_where_those_beside_it_lie_on_one_way(wrong):
    """Also if it is off by less than a metre."""
    poses, times = drive()
    broken = poses.copy()
    broken[[50, 90, 140]] += wrong
    found, said = without_outliers(broken, times)
    assert np.abs(found - poses).max() < 0.01
    assert said.startswith("odometry has 3 single wrong values,")
    options = OdometryOutlierOptions(min_single=1.0)
    assert without_outliers(broken, times, options)[0] is broken


@pytest.mark.parametrize("name", ["intel", "fr-clinic"])
def test_times_that_are_made_up_tell_no_single_value(name: str, tmp_path: Path):
    """The scans of intel come in bursts; spread evenly between whole seconds their motion is uneven."""
    recorded = read_log(str(data_file(f"{name}.log.gz")))
    for stamps in ([f"{int(time)}.0" for time in recorded.times], ["0"] * len(recorded)):
        path = tmp_path / "seconds.log"
        path.write_bytes(with_own_angles(replace(recorded, stamps=tuple(stamps))))
        log = read_log(str(path))
        assert not any(said.startswith(BEGINNING) for said in log.report.contradictions + log.report.warnings)


def test_single_values_are_found_where_times_are_irregular():
    """A match corrects the smaller ones; of the larger ones the poses beside tell enough."""
    poses, times = drive()
    uneven = np.sort(times + np.random.default_rng(1).uniform(0.0, 0.5, len(times)))
    for off, said in ((1.3, "odometry has 2 single"), (0.4, "")):
        broken = poses.copy()
        broken[[50, 140], 0] += off
        assert without_outliers(broken, uneven)[1].startswith(said)
        assert bool(without_outliers(broken, uneven)[1]) == bool(said)


def test_a_reset_and_a_short_stop_are_none():
    poses, times = drive()
    reset, stop = poses.copy(), poses.copy()
    reset[100:] -= poses[100]
    stop[100:110] = poses[100]
    for odometry in (poses, reset, stop):
        found, said = without_outliers(odometry, times)
        assert found is odometry
        assert not said


def test_two_drivers_that_alternate_are_left():
    """It is open which of them is right."""
    poses, times = drive()
    both = poses.copy()
    both[1::2] -= 30.0
    found, said = without_outliers(both, times)
    assert found is both
    assert not said


def test_a_robot_that_turns_round_fast_is_believed():
    poses = np.zeros((100, 3))
    poses[:, 0] = 0.5 * np.abs(np.mod(np.arange(100), 10) - 5)
    found, said = without_outliers(poses, 0.5 * np.arange(100, dtype=np.float64))
    assert found is poses
    assert not said


def test_unknown_poses_stay_unknown():
    poses, times = drive()
    broken = poses.copy()
    broken[40], broken[42] = np.nan, 0.0
    found, _ = without_outliers(broken, times)
    assert np.isnan(found[40]).all()
    assert np.abs(np.delete(found - poses, 40, axis=0)).max() < 0.01
    assert without_outliers(broken[:2], times[:2])[1] == ""


def test_a_text_log_is_read_so(tmp_path):
    written = way()
    written[7::10] = 0.0
    log = lines.read(tmp_path, *carmen_with(written))
    assert any(said.startswith(BEGINNING) for said in log.report.contradictions)
    assert log.odometry is not None
    assert np.abs(log.odometry - way()).max() < 0.01
    recorded = lines.read(tmp_path, *carmen_with(written), options=ReadingOptions(as_recorded=True))
    assert recorded.odometry == pytest.approx(written, abs=1e-6)


def carmen_with(poses: Array) -> list[str]:
    """The lines of a CARMEN log of the room, with other odometry (S, 3)."""
    return [
        flaser(k / 10, tuple(scan), tuple(pose))
        for k, (scan, pose) in enumerate(zip(readings().tolist(), poses.tolist(), strict=True))
    ]


def test_a_recording_is_read_so(read):
    written = recording(readings())
    at = [k for k, message in enumerate(written) if message.topic == "/odom"][7::10]
    for k in at:
        written[k] = replace(written[k], content=Odom(written[k].log_time, 0.0, 0.0, 0.0))
    log = read(written)
    assert any(said.startswith(BEGINNING) for said in log.report.contradictions)
    assert log.odometry is not None
    assert np.abs(log.odometry - way()).max() < 0.01


@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel", "fr-campus", "fr-clinic"])
def test_odometry_of_real_logs_stays(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert not any(said.startswith(BEGINNING) for said in log.report.contradictions)
