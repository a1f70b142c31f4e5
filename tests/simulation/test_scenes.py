"""The scenes: what they promise to those who match and map them."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.files.provenance import Source
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.text import carmen
from nscan_cli.poses import compose, transform, wrap
from tests.simulation.laser import Laser, exact
from tests.simulation.office import ROOMS
from tests.simulation.scenes import FIG_3, Scene, corridor_and_room, office


@pytest.fixture(scope="module")
def floor() -> Scene:
    return office()


def test_the_office_is_driven_without_a_scratch(floor):
    truth = floor.truth()
    assert floor.world.clearance(truth[:, :2]).min() > 0.25
    assert 1500 < len(truth) < 2600
    inside = [
        (
            (truth[:, 0] > x1 + 0.3)
            & (truth[:, 0] < x2 - 0.3)
            & (truth[:, 1] > y1 + 0.3)
            & (truth[:, 1] < y2 - 0.3)
        ).any()
        for x1, y1, x2, y2 in ROOMS
    ]
    assert sum(inside) >= 10


def test_the_office_loop_is_driven_more_than_one_and_a_half_times(floor):
    truth = floor.truth()
    around = np.unwrap(np.arctan2(truth[:, 1] - 12.4, truth[:, 0] - 19.5))
    assert (around[-1] - around[0]) / (2 * np.pi) > 1.5


def test_the_office_odometry_drifts_by_several_degrees(floor):
    recording = floor.record(1, laser=Laser(beams=2))
    off = np.degrees(
        np.abs(wrap(compose(recording.truth[0], recording.odometry)[:, 2] - recording.truth[:, 2]))
    )
    assert 3 < off.max() < 15


def test_end_points_without_noise_lie_on_the_floor_plan(floor):
    truth = floor.truth()[::150]
    log = floor.record_at(truth, 1, laser=exact(floor.laser)).log()
    for row, pose in enumerate(truth):
        points = transform(pose, log.points(row))
        assert len(points) > 100
        assert floor.world.clearance(points).max() < 1e-5


def test_the_same_seed_gives_the_same_recording_and_another_another():
    scene = corridor_and_room()
    assert scene.record(5).carmen() == scene.record(5).carmen()
    assert scene.record(5).carmen() != scene.record(6).carmen()


def test_carmen_text_read_back_is_the_log_in_memory():
    recording = corridor_and_room().record(5)
    text, log = recording.carmen(), recording.log()
    assert carmen.recognises(text)
    back = carmen.read(text, "x.log", Source("x.log", "", 0), ReadingOptions(strict=True))
    np.testing.assert_allclose(back.ranges, log.ranges, atol=1e-6)
    assert back.odometry is not None
    assert log.odometry is not None
    np.testing.assert_allclose(back.odometry, log.odometry, atol=6e-7)
    assert back.truth is not None
    assert log.truth is not None
    np.testing.assert_allclose(back.truth, log.truth, atol=6e-7)
    np.testing.assert_array_equal(back.truth_times, log.truth_times)
    np.testing.assert_allclose(back.angle_min, log.angle_min)
    np.testing.assert_allclose(back.angle_increment, log.angle_increment)
    np.testing.assert_allclose(back.mount, log.mount, atol=1e-6)
    assert back.stamps == log.stamps
    assert back.no_return == log.no_return
    assert back.report.warnings == ()


def test_fig_3_leaves_one_direction_open_in_two_pairs():
    """The walls that two scans share: their normals tell in which directions the pair is constrained."""
    scene = corridor_and_room()
    log = scene.record_at(FIG_3, 1, laser=exact(scene.laser)).log()
    start, edge = scene.world.segments[:, :2], np.diff(scene.world.segments.reshape(-1, 2, 2), axis=1)[:, 0]
    seen = []
    for row, pose in enumerate(FIG_3):
        points = transform(pose, log.points(row))
        offset = points[:, None] - start
        along = np.sum(offset * edge, axis=-1) / np.sum(edge**2, axis=-1)
        off = np.linalg.norm(offset - along.clip(0, 1)[..., None] * edge, axis=-1)
        walls, counts = np.unique(off.argmin(axis=1), return_counts=True)
        seen.append(set(walls[counts > 1].tolist()))

    def directions(i: int, j: int) -> set[str]:
        return {"y" if abs(edge[wall][0]) > abs(edge[wall][1]) else "x" for wall in seen[i] & seen[j]}

    assert directions(0, 1) == {"y"}
    assert directions(0, 2) == {"x"}
    assert directions(1, 2) == {"x", "y"}
