"""Odometry of two sources that alternate: one of them is used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.two_odometries import of_one_source
from nscan_cli.poses import Array, compose, relative
from tests.data import data_file
from tests.logs import lines
from tests.logs.lines import flaser
from tests.logs.noisy_room import readings, recording, way
from tests.logs.recordings.messages import Odom

BEGINNING = "odometry comes from two sources that alternate"
ELSEWHERE = np.array([1.0, 2.0, 0.7])


def drive(poses: int = 200) -> tuple[Array, Array]:
    """Poses (S, 3) of an arc, and their times (S,), s."""
    turned = 0.02 * np.arange(poses)
    along = np.stack([5.0 * np.sin(turned), -5.0 * np.cos(turned), turned], axis=1)
    return along, 0.1 * np.arange(poses, dtype=np.float64)


def known(found: Array, poses: Array) -> Array:
    """How far found poses are from others, where they are known."""
    return np.abs(relative(found, poses))[np.isfinite(found).all(axis=1)]


@pytest.mark.parametrize("seed", [None, 1, 2, 3])
def test_the_source_with_most_poses_is_used(seed):
    poses, times = drive()
    is_other = np.arange(len(poses)) % 3 == 1
    if seed is not None:
        is_other = np.random.default_rng(seed).random(len(poses)) < 0.4
    both = np.where(is_other[:, None], compose(ELSEWHERE, poses), poses)
    found, said = of_one_source(both, times)
    assert known(found, poses).max() < 0.03
    assert np.isfinite(found).all(axis=1).sum() > 0.95 * len(poses)
    assert said.startswith(BEGINNING)


def test_a_source_that_drifts_away_is_told_apart():
    poses, times = drive()
    both = poses.copy()
    both[1::2, :2] *= 1.3
    found, said = of_one_source(both, times)
    assert said.startswith(BEGINNING)
    steps = np.diff(found[100:-1], axis=0)
    assert np.hypot(steps[:, 0], steps[:, 1]).max() < 0.2


def test_a_source_that_stands_is_none():
    poses, times = drive()
    both = poses.copy()
    both[np.arange(len(poses)) % 3 > 0] = 0.0
    found, said = of_one_source(both, times)
    assert said
    assert known(found, poses).max() < 0.03


def test_noise_a_reset_and_few_wrong_values_are_no_second_source():
    poses, times = drive()
    noisy = poses + np.random.default_rng(1).normal(0.0, 0.5, poses.shape)
    reset, wrong, slow = poses.copy(), poses.copy(), poses[np.arange(len(poses)) // 5 * 5]
    reset[100:] += 10.0
    wrong[7::10] = 0.0
    for odometry in (poses, noisy, reset, wrong, slow, poses[:3], poses[:0]):
        found, said = of_one_source(odometry, times[: len(odometry)])
        assert found is odometry
        assert said == ""


def test_a_text_log_and_a_recording_are_read_so(tmp_path, read):
    written = way()
    written[1::2] = compose(ELSEWHERE, written[1::2])
    scans = [
        flaser(k / 10, tuple(scan), tuple(pose))
        for k, (scan, pose) in enumerate(zip(readings().tolist(), written.tolist(), strict=True))
    ]
    as_recorded = lines.read(tmp_path, *scans, options=ReadingOptions(as_recorded=True))
    assert as_recorded.odometry == pytest.approx(written, abs=1e-6)
    messages = recording(readings())
    is_other = False
    for k, message in enumerate(messages):
        at = message.content
        if isinstance(at, Odom):
            if is_other:
                moved = compose(ELSEWHERE, np.array([at.x, at.y, at.yaw]))
                messages[k] = replace(message, content=Odom(at.stamp, *moved.tolist()))
            is_other = not is_other
    for log in (lines.read(tmp_path, *scans), read(messages)):
        assert any(said.startswith(BEGINNING) for said in log.report.contradictions)
        assert log.odometry is not None
        assert known(log.odometry, way()).max() < 0.05


@pytest.mark.logs
@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic"])
def test_no_real_log_has_two(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert not any(said.startswith(BEGINNING) for said in log.report.contradictions)
