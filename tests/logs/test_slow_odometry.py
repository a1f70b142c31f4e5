"""Odometry whose poses are repeated until a new one comes: steady motion takes over between two of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.slow_odometry import without_repeats
from nscan_cli.poses import Array, wrap
from tests.data import data_file
from tests.logs import lines
from tests.logs.lines import flaser
from tests.logs.noisy_room import SCANS, Readings, readings, recording, way
from tests.logs.recordings.messages import PERIOD, START, Odom, Written

BEGINNING = "odometry comes less often than the log says"


def repeated(poses: Array, times: int) -> Array:
    """Each pose so many times, up to as many as there were."""
    return poses[np.arange(len(poses)) // times * times]


def arc(poses: int, step: tuple[float, float, float]) -> Array:
    """(S, 3) poses of a robot that drives along an arc, by so much (3,) from one to the next."""
    turned = step[2] * np.arange(poses, dtype=np.float64)
    chords = step[0] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    return np.column_stack([np.cumsum(chords, axis=0), turned])


@given(
    times=st.integers(2, 8),
    speed=st.floats(0.02, 0.3),
    turn=st.floats(-0.1, 0.1),
)
def test_a_steady_drive_is_restored(times, speed, turn):
    true = arc(97, (speed, 0.0, turn))
    found, said = without_repeats(repeated(true, times), seconds(97))
    assert said.startswith(f"{BEGINNING}: it repeats each pose for {0.1 * times:.2g} s")
    whole = (len(true) - 1) // times * times + 1
    # The chord of an arc is off by its height.
    height = 0.125 * speed * times * abs(turn) * times + 1e-9
    assert np.abs(found[:whole, :2] - true[:whole, :2]).max() <= 1.3 * height
    assert np.abs(wrap(found[:whole, 2] - true[:whole, 2])).max() < 1e-9


@given(times=st.integers(2, 6), stand=st.integers(20, 60))
def test_where_the_robot_stands_it_goes_on_standing(times, stand):
    drive = repeated(arc(61, (0.1, 0.0, 0.02)), times)
    odometry = np.concatenate([drive, np.repeat(drive[-1:], stand, axis=0), drive[-1] + drive - drive[0]])
    found, said = without_repeats(odometry, seconds(len(odometry)))
    assert said
    assert (found[len(drive) : len(drive) + stand] == drive[-1]).all()


@pytest.mark.parametrize("every", [1, 40])
def test_odometry_at_the_rate_of_the_scans_stays(every):
    """Also where poses are repeated for so long that steady motion tells little."""
    odometry = repeated(arc(800, (0.1, 0.0, 0.01)), every)
    found, said = without_repeats(odometry, seconds(800))
    assert not said
    assert found is odometry


def test_unknown_poses_stay_unknown():
    odometry = repeated(arc(100, (0.1, 0.0, 0.01)), 4)
    odometry[40:50] = np.nan
    found, said = without_repeats(odometry, seconds(100))
    assert said
    assert np.isnan(found[40:50]).all()
    assert np.isfinite(np.delete(found, slice(40, 50), axis=0)).all()


def seconds(poses: int) -> Array:
    """(S,) times of so many poses."""
    return np.linspace(0.0, 0.1 * (poses - 1), poses)


def carmen(ranges: Readings, odometry: Array) -> list[str]:
    return [
        flaser(k / 10, tuple(scan), tuple(pose))
        for k, (scan, pose) in enumerate(zip(ranges.tolist(), odometry.tolist(), strict=True))
    ]


@pytest.mark.parametrize("times", [2, 3])
def test_a_text_log_is_read_so(tmp_path, times):
    scans = carmen(readings(), repeated(way(), times))
    log = lines.read(tmp_path, *scans)
    assert any(said.startswith(BEGINNING) for said in log.report.contradictions)
    assert log.odometry is not None
    whole = (SCANS - 1) // times * times + 1
    assert np.abs(log.odometry[:whole] - way()[:whole]).max() < 0.01
    recorded = lines.read(tmp_path, *scans, options=ReadingOptions(as_recorded=True))
    assert recorded.odometry == pytest.approx(repeated(way(), times), abs=1e-6)
    # The whole log decides, whichever scans are selected.
    selected = lines.read(tmp_path, *scans, options=ReadingOptions(every=times))
    assert selected.odometry is not None
    assert selected.odometry == pytest.approx(log.odometry[::times])


def test_a_robot_that_stops_for_each_scan_jumps(tmp_path):
    stops = np.arange(SCANS) // 3 * 3
    noise = 0.005 * np.random.default_rng(2).standard_normal((SCANS, 180)).astype(np.float32)
    log = lines.read(tmp_path, *carmen(readings()[stops] + noise, way()[stops]))
    assert not any(said.startswith(BEGINNING) for said in log.report.contradictions)
    assert log.odometry == pytest.approx(way()[stops], abs=1e-6)


def test_a_recording_whose_odometry_is_published_again_is_read_so(read):
    """Poses of every third scan, five times between two scans."""
    written = [message for message in recording(readings()) if message.topic != "/odom"]
    poses = repeated(way(), 3)
    for k, (x, y, yaw) in enumerate(np.repeat(poses, 5, axis=0).tolist()):
        at = START + k * (PERIOD // 5)
        written.append(Written("/odom", at, Odom(at, x, y, yaw)))
    log = read(sorted(written, key=lambda message: message.log_time))
    assert any(said.startswith(BEGINNING) for said in log.report.contradictions)
    assert log.odometry is not None
    whole = (SCANS - 1) // 3 * 3 + 1
    assert np.abs(log.odometry[:whole] - way()[:whole]).max() < 0.02


@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel", "fr-campus", "fr-clinic"])
def test_odometry_of_real_logs_stays(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert not any(said.startswith(BEGINNING) for said in log.report.contradictions)
