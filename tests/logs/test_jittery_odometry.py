"""Odometry that goes to and fro for some seconds is not used there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.logs.jittery_odometry import JitteryOdometryOptions, without_jitter
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, are_known
from tests.data import data_file
from tests.logs import lines
from tests.logs.noisy_room import readings, recording, way
from tests.logs.recordings.messages import Odom
from tests.logs.test_odometry_outliers import carmen_with, drive

BEGINNING = "odometry goes to and fro as no robot drives"
BURST = slice(80, 110)


def noisy(poses: Array, distance: float, turn: float, rows: slice = BURST) -> Array:
    """Poses (S, 3) with white noise in some rows: its standard deviations are in m and rad."""
    noise = np.random.default_rng(3).standard_normal(poses[rows].shape)
    broken = poses.copy()
    broken[rows] += noise * (distance, distance, turn)
    return broken


@pytest.mark.parametrize(("distance", "turn"), [(0.2, 0.0), (0.5, 0.0), (0.0, 0.35), (0.5, 0.35)])
def test_noise_is_not_used(distance, turn):
    poses, times = drive()
    found, said = without_jitter(noisy(poses, distance, turn), times)
    known = are_known(found)
    assert said.startswith(BEGINNING)
    assert np.abs(found[known] - poses[known]).max() < 0.25
    assert known[: BURST.start - 8].all()
    assert known[BURST.stop + 8 :].all()
    assert np.count_nonzero(~known[BURST]) > 20


def test_each_stretch_is_named():
    poses, times = drive()
    broken = noisy(noisy(poses, 0.5, 0.0), 0.5, 0.0, slice(20, 50))
    said = without_jitter(broken, times)[1]
    assert said.count(" to ") == 1 + 2
    assert "there, and steady motion takes its place" in said


@pytest.mark.parametrize(
    "options",
    [
        JitteryOdometryOptions(max_correlation=-1.0),
        JitteryOdometryOptions(min_distance=2.0),
        JitteryOdometryOptions(min_of_steps=1.5),
        JitteryOdometryOptions(max_share=0.05),
    ],
)
def test_each_bound_decides(options):
    poses, times = drive()
    broken = noisy(poses, 0.5, 0.0)
    assert without_jitter(broken, times, options)[0] is broken


def test_a_reset_a_stop_and_a_robot_that_shuttles_are_none():
    poses, times = drive()
    reset, stop, shuttle = poses.copy(), poses.copy(), np.zeros((200, 3))
    reset[100:] -= poses[100]
    stop[100:110] = poses[100]
    shuttle[:, 0] = 0.1 * np.abs(np.mod(np.arange(200), 10) - 5)
    for odometry in (poses, reset, stop, shuttle):
        assert without_jitter(odometry, times)[0] is odometry


@pytest.mark.parametrize("unit", [100.0, 1000.0])
def test_another_unit_is_no_noise(unit):
    """Stamps that are early and late in turn make a steady drive uneven, in millimetres by many metres."""
    poses, times = drive()
    uneven = times + 0.02 * (-1.0) ** np.arange(len(times))
    scaled = poses * (unit, unit, 1.0)
    assert without_jitter(scaled, uneven)[0] is scaled
    few = JitteryOdometryOptions(min_of_steps=0.0, max_share=1.0)
    assert without_jitter(scaled, uneven, few)[1].startswith(BEGINNING)


def test_unknown_poses_stay_unknown():
    poses, times = drive()
    broken = noisy(poses, 0.5, 0.0)
    broken[40] = np.nan
    found, said = without_jitter(broken, times)
    assert said
    assert np.isnan(found[40]).all()
    assert without_jitter(broken[:5], times[:5])[1] == ""


def test_a_text_log_is_read_so(tmp_path):
    written = noisy(way(), 0.5, 0.0, slice(12, 28))
    log = lines.read(tmp_path, *carmen_with(written))
    assert log.odometry is not None
    known = are_known(log.odometry)
    assert any(said.startswith(BEGINNING) for said in log.report.contradictions)
    assert not known[14:26].any()
    assert np.abs(log.odometry[known] - way()[known]).max() < 0.25
    recorded = lines.read(tmp_path, *carmen_with(written), options=ReadingOptions(as_recorded=True))
    assert recorded.odometry == pytest.approx(written, abs=1e-6)


def test_a_recording_is_read_so(read):
    """Nothing is interpolated over what is not used."""
    messages, poses = recording(readings()), noisy(way(), 0.5, 0.0, slice(12, 28))
    at = [k for k, message in enumerate(messages) if message.topic == "/odom"]
    for k, (x, y, heading) in zip(at, poses.tolist(), strict=True):
        messages[k] = replace(messages[k], content=Odom(messages[k].log_time, x, y, heading))
    log = read(messages)
    assert log.odometry is not None
    known = are_known(log.odometry)
    assert any(said.startswith(BEGINNING) for said in log.report.contradictions)
    assert not known[14:26].any()
    assert known[[0, -1]].all()


@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel", "mit-killian", "fr-campus", "fr-clinic"])
def test_odometry_of_real_logs_stays(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert not any(said.startswith(BEGINNING) for said in log.report.contradictions)
