"""Keyframes as a faultless tracker would give them, and drives made of them that a slip has bent."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.model import Pairwise
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.frontend.tracked_scans import TrackedScan
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.keyframe_selection import Keyframes
from nscan_cli.slam.keyframes.options import KeyframeOptions
from nscan_cli.slam.keyframes.route import Route, chain_relations, route_of
from nscan_cli.slam.keyframes.tracked_path import TrackedPath
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, LocalMatcher
from nscan_cli.slam.local_matching.neighbours import choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.loop_detector import LoopDetector
from nscan_cli.slam.loop_closure.place import Place
from tests.logs.excerpts import truth_of
from tests.simulation.drive import Drive
from tests.simulation.faults import without_returns
from tests.simulation.laser import Laser
from tests.simulation.office import office_world
from tests.simulation.scenes import Scene
from tests.simulation.world import Builder
from tests.slam.mapped_logs import found_of, sensed_in

ROWS = 10
"""From one keyframe's row to the next: rows and keyframes are not to be mixed up."""
AROUND = np.array([0.0, -0.44, -0.22, 0.22, 0.44])
"""m along the heading: a keyframe's own scan, then those that grow its Gaussians."""
BEHIND = NScanOptions().centre_delay


def about(match: LocalMatcher, route: Route, centre: int, options: NScanOptions) -> LocalMatch | None:
    """The match of a keyframe with those near it."""
    near = choose_neighbours(route.poses, route.paths, centre, options)
    return match(route, centre, near, options)


def keyframe_of(scene: Scene, row: int, pose: Array, path: float, seen: Array) -> Keyframe:
    """A keyframe at a pose (3,) that saw what there is to see from poses (n, 3), the first its own."""
    log = scene.record_at(seen, seed=row).log()
    poses = compose(pose, relative(seen, seen[0]))
    scans = [TrackedScan(place, np.diag([1e5, 1e5, 1e6]), np.eye(3), 0.95, path, True) for place in poses]
    found = Keyframes(KeyframeOptions(), NScanOptions().gaussians)
    found.add(row, log.points(0), scans[0])
    found.attach(sensed_in(log), found_of(*scans), 1, len(scans))
    found.end_segment()
    return found.list[0]


def relation_to_previous(keyframes: list[Keyframe]) -> Pairwise:
    """The relation of the last keyframe to the one before."""
    (relation,) = chain_relations(keyframes[-2:], KeyframeOptions())
    return relation


class Driven(NamedTuple):
    """A drive."""

    keyframes: list[Keyframe]
    chain: list[Pairwise]
    poses: Array
    """(K, 3) what the chain makes of it."""
    truth: Array
    """(K, 3)"""

    def bent(self, at: int, slip: Sequence[float]) -> Driven:
        """The drive with the relation `chain[at]` off by a pose (3,)."""
        chain = self.chain.copy()
        wrong = compose(chain[at].measurement, np.array(slip))
        chain[at] = dataclasses.replace(chain[at], measurement=wrong)
        return self._replace(chain=chain, poses=along(chain))


def along(chain: Sequence[Pairwise]) -> Array:
    """(K, 3) the poses that a chain leads to from the origin."""
    poses = [np.zeros(3)]
    for relation in chain:
        poses.append(compose(poses[-1], relation.measurement))
    return np.array(poses)


def driven(scene: Scene, truth: Array, paths: Array, seen: Array | None = None) -> Driven:
    """Keyframes at true poses (K, 3), each so far along the path (K,); scans `seen` elsewhere, if given."""
    views = truth if seen is None else seen
    beside = np.stack([AROUND, np.zeros(5), np.zeros(5)], axis=1)
    keyframes = [
        keyframe_of(scene, ROWS * k, truth[k], float(paths[k]), compose(views[k], beside))
        for k in range(len(truth))
    ]
    chain = [relation_to_previous(keyframes[: k + 1]) for k in range(1, len(keyframes))]
    return Driven(keyframes, chain, along(chain), relative(truth, truth[0]))


def round_scene(max_range: float = 30.0) -> Scene:
    """Once round the office's corridor, 66 m, and 16 m further; nothing keeps the robot from haste."""
    west, east, south, north = 6.9, 32.1, 7.55, 17.2
    way = [(9.0, south), (30.9, south), (east, 8.9), (east, 16.0), (31.0, north), (8.2, north)]
    way += [(west, 15.9), (west, 8.8), (7.9, south), (24.0, south)]
    return Scene("round", office_world(), np.array(way), Drive(speed=1.1), Laser(max_range=max_range))


def path_of(truth: Array) -> Array:
    """(S,) how far along the way each pose lies, m."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(truth[:, :2], axis=0).T))])


@functools.cache
def round_drive() -> Driven:
    """A keyframe every 1.5 m of round_scene()."""
    scene = round_scene()
    truth = scene.truth()
    path = path_of(truth)
    rows = np.searchsorted(path, np.arange(0.0, path[-1], 1.5))
    return driven(scene, truth[rows], path[rows])


ROUND = 66.0
"""m of path after which round_scene() is where it began."""


def slipped_round(slip: Sequence[float], seed: int = 5, max_range: float = 30.0) -> LaserLog:
    """The log of round_scene(), but from 50 to 53 m it sees nothing, and its odometry slips by a pose."""
    log = round_scene(max_range).record(seed).log()
    path = path_of(truth_of(log))
    blind = np.flatnonzero((path > 50.0) & (path < 53.0))
    assert log.odometry is not None
    steps, odometry = relative(log.odometry[1:], log.odometry[:-1]), log.odometry.copy()
    # In steps of less than a metre: at once nobody would believe it.
    some = blind[len(blind) // 2 :][:3] - 1
    steps[some] = compose(steps[some], np.array(slip) / len(some))
    for row in range(int(blind[0]), len(log)):
        odometry[row] = compose(odometry[row - 1], steps[row - 1])
    return dataclasses.replace(without_returns(log, blind), odometry=odometry)


def like_doors(period: float = 3.0, cabinets: Sequence[float] = ()) -> Scene:
    """A corridor 120 m long with a pair of equal niches every 3 m: a step of 3 m changes nothing.

    Unless there are `cabinets`, each at so many m along it.
    """
    floor = Builder()
    for side in (-1.1, 1.1):
        outwards = np.sign(side) * 0.6
        for x in np.arange(-60.0, 60.0, period):
            floor.line(x, side, x + period - 1.0, side)
            floor.line(x + period - 1.0, side, x + period - 1.0, side + outwards)
            floor.line(x + period - 1.0, side + outwards, x + period, side + outwards)
            floor.line(x + period, side + outwards, x + period, side)
    for x in cabinets:
        floor.box(x, 0.7, x + 0.5, 1.1)
    return Scene("like_doors", floor.world(), np.array([(-20.0, 0.0), (20.0, 0.0)]))


CABINETS = (-5.2, 1.1)
"""m along the corridor of like_doors(): they tell its doors apart, by little of what is seen."""


@functools.cache
def like_doors_drive(cabinets: tuple[float, ...] = ()) -> Driven:
    """Twice along 24 m of the corridor of like_doors(), with 40 m of way between that saw nothing of it."""
    x = np.arange(0.0, 24.0, 1.5) - 12.0
    truth = np.zeros((2 * len(x), 3))
    truth[:, 0] = np.concatenate([x, x + 0.4])
    paths = np.concatenate([x + 12.0, x + 76.0])
    return driven(like_doors(cabinets=cabinets), truth, paths)


TWIN = 5.8
"""m"""


def twin_corridors() -> Scene:
    """Two corridors, one beside the other, with the same doors and cabinets in the same places."""
    floor = Builder()
    for y in (0.0, TWIN):
        floor.line(-30.0, y - 1.0, 30.0, y - 1.0)
        floor.line(-30.0, y + 1.0, 30.0, y + 1.0)
        for x in (-11.3, -8.2, -2.9, 0.4, 6.8, 10.1):
            floor.box(x, y + 0.6, x + 0.5, y + 1.0)
        for x in (-9.7, -4.6, 2.2, 5.1, 12.4):
            floor.box(x, y - 1.0, x + 0.9, y - 0.75)
    return Scene("twin_corridors", floor.world(), np.array([(-12.0, 0.0), (12.0, 0.0)]))


@functools.cache
def twin_drive(apart: float = TWIN) -> Driven:
    """Along one of twin_corridors(), and 40 m later along the other; or with 0 along the same again."""
    x = np.arange(0.0, 24.0, 1.5) - 12.0
    truth = np.zeros((2 * len(x), 3))
    truth[:, 0] = np.concatenate([x, x + 0.4])
    truth[len(x) :, 1] = apart
    return driven(twin_corridors(), truth, np.concatenate([x + 12.0, x + 76.0]))


def closed_along(
    closing: LoopDetector, drive: Driven, until: int | None = None, left_out: Sequence[int] = ()
) -> list[tuple[int, list[Place]]]:
    """What Closing gives for centre after centre, as in the loop: (centre, places) where there are any.

    The graph is that of the chain alone; it is not mended by what is found. Every joint match has
    `left_out` these keyframes of another visit.
    """
    keyframes, chain, poses, _ = drive
    others, found = np.array(left_out, dtype=np.int64), []
    for newest in range(1, len(keyframes) if until is None else until + BEHIND + 1):
        length = keyframes[newest].tracked.path - keyframes[newest - 1].tracked.path
        closing.extend(chain[newest - 1], length)
        size, centre = newest + 1, newest - BEHIND
        if centre < 0:
            continue

        out = others[others < centre]
        places = closing.close(route_of(keyframes, chain, poses[:size]), centre, out, list)
        if places:
            found.append((centre, places))
    return found


def exact_path(relations: Iterable[Pairwise]) -> TrackedPath:
    """The path of these relations, without slips."""
    path = TrackedPath(0.0, 0.0)
    for relation in relations:
        path.extend(relation, 0.0)
    return path
