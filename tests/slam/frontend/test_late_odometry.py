"""Odometry that begins later than the log: the robot drove before as it drives then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, relative
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.frontend.segment_tracker import first_speed
from tests.simulation.scenes import Scene, bare_corridor, corridor_and_room
from tests.slam.mapped_logs import mapped


def late(scene: Scene, share: float, seed: int = 31) -> tuple[LaserLog, Array]:
    """A drive whose first scans have no odometry, and its true path."""
    recording = scene.record(seed)
    log = recording.log()
    assert log.odometry is not None
    odometry = log.odometry.copy()
    odometry[: int(share * len(log))] = np.nan
    return replace(log, odometry=odometry, odometry_path=None), recording.truth


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_a_drive_that_begins_in_a_bare_corridor(share: float):
    """The robot seemed to stand: 2.6 m were missing, and nothing said so."""
    log, truth = late(corridor_and_room(), share)
    poses = mapped(log).graph.poses
    off = relative(poses[-1], poses[0]) - relative(truth[-1], truth[0])
    assert np.hypot(*off[:2]) < 0.1


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_where_nothing_tells_the_way_sigma_does(share: float):
    """Of 40 m 20 were missing, at a sigma of 0.6 m."""
    log, truth = late(bare_corridor(), share)
    run = mapped(log)
    poses, last = run.graph.poses, int(run.graph.keyframes[-1])
    off = relative(poses[last], poses[0]) - relative(truth[last], truth[0])
    error = float(np.hypot(*off[:2]))
    sigma = float(np.sqrt(np.linalg.eigvalsh(run.graph.marginals[last][:2, :2])[-1]))
    assert error < 0.25 * 40.0
    assert 0.5 * error < sigma < 3.0 * error
    assert any("the walls do not show how far" in said for said in notices(run.state))


def test_the_speed_is_that_with_which_odometry_begins():
    log, _ = late(bare_corridor(), 0.5)
    assert log.odometry is not None
    whole = bare_corridor().record(31).log()
    assert first_speed(whole, 5) == 0.0
    driven = np.hypot(*(log.odometry[-1] - log.odometry[len(log) // 2 + 1])[:2])
    lasted = log.times[-1] - log.times[len(log) // 2 + 1]
    assert first_speed(log, 5) == pytest.approx(driven / lasted, rel=0.2)
    assert first_speed(replace(log, odometry=None), 5) == 0.0
