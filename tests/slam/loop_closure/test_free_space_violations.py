"""Where one visit looks through what another saw."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.tracked_scans import TrackedScan
from nscan_cli.slam.keyframes.keyframe_selection import Keyframes
from nscan_cli.slam.keyframes.options import KeyframeOptions
from nscan_cli.slam.keyframes.route import Route, route_of
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.free_space_violations import (
    FreeSpaceViolation,
    free_space_violations,
    sound_share,
)
from nscan_cli.slam.loop_closure.options import FreeSpaceOptions
from tests.logs.excerpts import truth_of
from tests.simulation.laser import Laser
from tests.slam.keyframe_drives import ROUND, path_of, round_scene
from tests.slam.mapped_logs import mapped_real

OPTIONS = FreeSpaceOptions()
EVERY = 1.5
"""m of path from keyframe to keyframe."""


@functools.cache
def simulated(mount: tuple[float, float, float] = Laser.mount, seed: int = 5) -> LaserLog:
    scene = round_scene()
    return scene.record(seed, dataclasses.replace(scene.laser, mount=mount)).log()


def route_at(log: LaserLog, poses: Array, blind: slice = slice(0, 0)) -> Route:
    """Keyframes at poses (S, 3), of all scans; some of them with no points to match."""
    path = path_of(truth_of(log))
    rows = np.searchsorted(path, np.arange(0.0, path[-1], EVERY))
    keyframes = Keyframes(KeyframeOptions(), NScanOptions().gaussians)
    for k, row in enumerate(rows.tolist()):
        points = log.points(row)[: 0 if k in range(*blind.indices(len(rows))) else None]
        found = TrackedScan(poses[row], np.eye(3), np.eye(3), 1.0, float(path[row]), True)
        keyframes.add(row, points, found)
    return route_of(keyframes.list, [], poses[rows])


def worst(log: LaserLog, poses: Array) -> FreeSpaceViolation:
    found = free_space_violations(log, route_at(log, poses), NScanOptions(), OPTIONS)
    assert found is not None
    return found


def slipped(log: LaserLog, metres: float) -> Array:
    """The true poses, those of the second visit so far ahead along the corridor."""
    poses = truth_of(log).copy()
    poses[path_of(poses) > ROUND, 0] += metres
    return poses


@pytest.mark.parametrize("mount", [Laser.mount, (-0.2, 0.1, 3.0)])
def test_what_stands_still_is_not_looked_through(mount):
    log = simulated(mount)
    found = worst(log, truth_of(log))
    assert found.share < 0.005
    assert found.within < 0.005
    assert found.share < sound_share(found.within, OPTIONS)


@pytest.mark.parametrize("seed", [5, 6, 7])
@pytest.mark.parametrize("metres", [-6.0, -3.0, -1.5, 1.5, 3.0, 6.0])
def test_a_visit_that_is_off_along_the_corridor_looks_through_walls(metres, seed):
    log = simulated(seed=seed)
    found = worst(log, slipped(log, metres))
    assert found.share > OPTIONS.max_share
    assert path_of(truth_of(log))[found.last] > ROUND


def test_the_direction_in_which_the_laser_turns_changes_nothing():
    log = simulated()
    turned = dataclasses.replace(
        log,
        ranges=log.ranges[:, ::-1].copy(),
        angle_min=log.angle_min + log.angle_increment * (log.ranges.shape[1] - 1),
        angle_increment=-log.angle_increment,
    )
    for metres in (0.0, 3.0):
        share = worst(log, slipped(log, metres)).share
        assert worst(turned, slipped(log, metres)).share == pytest.approx(share, abs=2e-3)


def with_ghosts(share: float) -> LaserLog:
    """Of all readings such a share is too short: dust, rain, people who pass."""
    log, rng = simulated(), np.random.default_rng(3)
    short = rng.random(log.ranges.shape) < share
    return dataclasses.replace(log, ranges=np.where(short, log.ranges * 0.5, log.ranges).astype(np.float32))


def test_where_much_is_looked_through_at_all_times_as_much_is_expected():
    log = with_ghosts(0.02)
    sound, wrong = worst(log, truth_of(log)), worst(log, slipped(log, 3.0))
    assert sound.within > OPTIONS.margin
    assert sound.share > OPTIONS.margin
    most = sound_share(sound.within, OPTIONS)
    assert sound.share < most == pytest.approx(OPTIONS.within_factor * sound.within + OPTIONS.margin)
    assert wrong.share > sound_share(wrong.within, OPTIONS)


def test_the_bound_is_never_above_what_wrong_maps_have():
    assert sound_share(0.1, OPTIONS) == OPTIONS.max_share
    assert sound_share(float("nan"), OPTIONS) == OPTIONS.max_share


def test_where_no_place_is_seen_again_there_is_nothing_to_compare():
    log = simulated()
    route = route_at(log, truth_of(log))
    once = int(np.searchsorted(route.paths, ROUND / 2))
    for part in (route_of(route.keyframes, [], route.poses[:once]), route_of([], [], np.zeros((0, 3)))):
        assert free_space_violations(log, part, NScanOptions(), OPTIONS) is None


def test_of_a_laser_that_hangs_nothing_is_compared():
    """Its readings stand in the log, but nothing of them was matched."""
    log = simulated()
    poses = slipped(log, 3.0)
    again = int(np.searchsorted(route_at(log, poses).paths, ROUND))
    some = free_space_violations(log, route_at(log, poses, slice(0, again)), NScanOptions(), OPTIONS)
    assert some is None or some.last < again + OPTIONS.min_keyframes


@pytest.mark.logs
@pytest.mark.parametrize("name", ["fr079", "mit-csail", "intel"])
def test_in_real_buildings_little_is_looked_through(name):
    found = mapped_real(name)
    seen = free_space_violations(found.log, found.state.route, found.state.options.nscan, OPTIONS)
    assert seen is not None
    assert seen.share < sound_share(seen.within, OPTIONS) / 2
    assert seen.share < 2 * seen.within
