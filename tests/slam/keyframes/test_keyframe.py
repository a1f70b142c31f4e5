"""Step 2: which scans become keyframes, the Gaussians around them, and their relations."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import Pairwise
from nscan_cli.ndt.energy import energy
from nscan_cli.ndt.grid_growth import make_all_gaussians
from nscan_cli.ndt.hash_grid import WALL_END
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, compose, relative, rotated_information
from nscan_cli.slam.frontend.tracked_scans import TrackedScan
from nscan_cli.slam.keyframes.keyframe_selection import Keyframes
from nscan_cli.slam.keyframes.options import KeyframeOptions
from nscan_cli.slam.keyframes.route import chain_relations
from tests.ndt.wall_points import room
from tests.slam.mapped_logs import found_of, sensed

OPTIONS = KeyframeOptions(distance=1.0, turn=0.5)
GAUSSIANS = GaussianOptions(cell=1.0, minimum=4)
EXPECTED = np.diag([1e3, 1e3, 1e3])
HESSIAN = np.array([[9e4, 1e4, 2e3], [1e4, 4e4, -3e3], [2e3, -3e3, 1.6e5]])


def tracked(pose: Array, hessian: Array = HESSIAN, path: float = 0.0, joined: bool = True) -> TrackedScan:
    return TrackedScan(np.asarray(pose, dtype=np.float64), hessian, EXPECTED, 0.9, path, joined)


def attach(found: Keyframes, seed: int, scan: TrackedScan) -> None:
    found.attach(sensed([room(seed)]), found_of(scan), 0, 1)


def keyframes(*poses: Array) -> Keyframes:
    """Keyframes at poses 1 m of path apart."""
    found = Keyframes(OPTIONS, GAUSSIANS)
    for row, pose in enumerate(poses):
        found.add(10 * row, room(row), tracked(pose, path=float(row)))
    return found


@pytest.mark.parametrize(
    ("pose", "near"),
    [
        ([0.0, 0.0, 3.0], True),
        ([0.6, 0.79, 3.0], True),
        ([0.6, 0.81, 3.0], False),
        ([-1.01, 0.0, 3.0], False),
        ([0.0, 0.0, 3.49 - 2 * np.pi], True),
        ([0.0, 0.0, 3.51 - 2 * np.pi], False),
        ([0.0, 0.0, 2.49], False),
        ([0.6, 0.6, 2.51], True),
    ],
)
def test_near_enough_by_distance_and_by_turn(pose, near):
    """Within 1 m and 0.5 rad of the last keyframe, at (0, 0, 3); the first is far away."""
    found = keyframes(np.array([50.0, 0, 0]), np.array([0.0, 0, 3.0]))
    found.select(sensed([room(2)]), found_of(tracked(pose)))
    assert [keyframe.row for keyframe in found.list[2:]] == ([] if near else [0])


@pytest.mark.parametrize("size", [1, 2, 5, 12])
def test_the_same_scans_become_keyframes_however_many_are_taken_in_at_a_time(size):
    """The first, then every third one of 0.4 m each, or where a piece begins; the others lie around them."""
    found, poses = Keyframes(OPTIONS, GAUSSIANS), [np.array([0.4 * k, 0.0, 0.0]) for k in range(12)]
    scans = sensed([room(k) for k in range(12)])
    tracks = found_of(*(tracked(poses[k], path=float(k)) for k in range(12)))
    for first in range(0, 12, size):
        rows = first, min(first + size, 12)
        found.select(scans.part(*rows), tracks.part(*rows))
    assert [keyframe.row for keyframe in found.list] == [0, 3, 6, 9]
    assert [keyframe.tracked.path for keyframe in found.list] == [0.0, 3.0, 6.0, 9.0]
    for keyframe, those in zip(found.list, [(0, 1, 2), (3, 1, 2, 4, 5), (6, 4, 5, 7, 8)], strict=False):
        points, sizes, at = map(np.concatenate, zip(*keyframe.around, strict=True))
        np.testing.assert_array_equal(points, np.concatenate([room(k) for k in those]))
        assert sizes.tolist() == [len(room(k)) for k in those]
        np.testing.assert_array_equal(at, [poses[k] for k in those])
    np.testing.assert_allclose([keyframe.prior_covariance for keyframe in found.list[1:]], 3 * [3 * EXPECTED])
    found.select(replace(sensed([room(12)]), first=12), found_of(tracked(poses[11])), begins=True)
    assert found.list[-1].row == 12


def expected(keyframe: Array, *scans: tuple[int, Array]) -> Ndt:
    """The NDT of the scans (seed, pose) seen from a keyframe's pose."""
    ndt = Ndt.empty(GAUSSIANS, neighbourhood=WALL_END)
    for seed, pose in scans:
        ndt.add(room(seed), relative(pose, keyframe))
    # What was made before the last scan came does not know all its surroundings.
    make_all_gaussians(ndt.grid, ndt.rows, ndt.half)
    return ndt


def gaussians(ndt: Ndt) -> Array:
    """(G, 7) those with points enough, in order of their means."""
    rows = ndt.grid.gaussians[ndt.grid.gaussians[:, 2] > 0]
    return rows[np.lexsort(np.round(rows[:, :2], 6).T)]


def test_a_keyframes_gaussians_are_of_the_scans_between_its_neighbours():
    poses = [np.array([0.4 * k, 0.1 * k, 0.2 * k]) for k in range(9)]
    found = Keyframes(OPTIONS, GAUSSIANS)
    for k, pose in enumerate(poses):
        if k % 3 == 0:
            found.add(k, room(k), tracked(pose))
        else:
            # The tracker's map does not want every scan, and nor do the keyframes.
            attach(found, k, tracked(pose, joined=k != 4))
    found.end_segment()
    around = {0: (0, 1, 2), 3: (1, 2, 3, 5), 6: (5, 6, 7, 8)}
    assert [keyframe.row for keyframe in found.list] == list(around)
    for keyframe in found.list:
        scans = [(k, poses[k]) for k in around[keyframe.row]]
        wanted = expected(poses[keyframe.row], *scans)
        assert len(gaussians(wanted)) > 30
        np.testing.assert_allclose(gaussians(keyframe.ndt), gaussians(wanted), rtol=1e-9, atol=1e-9)
        found_energy, wanted_energy = (
            energy(ndt, room(keyframe.row), np.full(3, 0.03)) for ndt in (keyframe.ndt, wanted)
        )
        np.testing.assert_allclose(found_energy.gradient, wanted_energy.gradient, rtol=1e-9)
        np.testing.assert_array_equal(keyframe.points, room(keyframe.row))
        # Nothing is kept that only growing needs.
        assert len(keyframe.ndt.grid.sums) == 0


def test_gaussians_are_made_once_by_whatever_thread_asks_and_the_scans_are_let_go():
    poses = [np.array([0.4 * k, 0.0, 0.0]) for k in range(4)]
    found = Keyframes(OPTIONS, GAUSSIANS)
    found.add(0, room(0), tracked(poses[0]))
    for k in (1, 2, 3):
        attach(found, k, tracked(poses[k]))
    found.end_segment()
    (keyframe,) = found.list
    assert len(keyframe.around) > 1
    with ThreadPoolExecutor(4) as pool:
        made = [*pool.map(lambda _: keyframe.ndt, range(8))]
    assert keyframe.around == []
    assert keyframe.ndt is keyframe.ndt
    for ndt in made:
        np.testing.assert_array_equal(ndt.grid.gaussians, keyframe.ndt.grid.gaussians)


def test_a_keyframe_keeps_nothing_of_the_scans_that_were_tracked_with_it():
    """All that is found for a stretch of scans is made together."""
    several = np.concatenate([room(0), room(1)])
    scans = [several[: len(room(0))], several[len(room(0)) :]]
    found = Keyframes(OPTIONS, GAUSSIANS)
    found.select(sensed(scans), found_of(tracked(np.zeros(3)), tracked(np.array([5.0, 0.0, 0.0]))))
    for keyframe, seen in zip(found.list, scans, strict=True):
        np.testing.assert_array_equal(keyframe.points, seen)
        scan = keyframe.tracked
        for array in (keyframe.points, scan.pose, scan.hessian, scan.prior_covariance):
            assert array.base is None


def test_finishing_no_keyframes_is_nothing():
    found = Keyframes(OPTIONS, GAUSSIANS)
    found.end_segment()
    assert len(found) == 0


def relation_to_previous(found: Keyframes) -> Pairwise:
    (relation,) = chain_relations(found.list[-2:], found.options)
    return relation


def test_the_relation_to_the_previous_keyframe():
    poses = [np.array(p) for p in ([5.0, 5, 1], [2.0, 1.0, 3.0], [2.5, 1.4, -3.0])]
    relation = relation_to_previous(keyframes(*poses))
    assert relation.nodes == (10, 20)
    np.testing.assert_allclose(relation.measurement, relative(poses[2], poses[1]))
    assert (relation.origin, relation.score) == ("track", 0.9)


def test_the_information_is_the_matchs_and_the_drifts():
    """Golden: heading 0, a diagonal Hessian, 1 m of way: 1/σ² of both in turn."""
    found = Keyframes(KeyframeOptions(information_scale=0.1, drift=0.01, drift_angle=0.002), GAUSSIANS)
    found.add(0, room(0), tracked(np.zeros(3)))
    found.add(1, room(1), tracked(np.array([1.0, 0, 0]), np.diag([1e5, 4e4, 2.5e5]), path=0.99))
    # 0.01² m² of drift along 1 m, and 1 / (0.1 · 1e5) of the match: 1 / (1e-4 + 1e-4).
    information = np.diag([5e3, 1 / (1e-4 + 2.5e-4), 1 / (4e-6 + 4e-5)])
    np.testing.assert_allclose(relation_to_previous(found).information, information, rtol=1e-5, atol=1e-3)


@given(st.integers(0, 10**6), st.sampled_from([0, 1, 2, 3]), st.floats(0, 50))
@settings(max_examples=50, deadline=None)
def test_the_information_is_positive_definite_and_never_more_than_the_drift_allows(seed, rank, length):
    """Whatever the Hessian: of full rank, of a corridor, or 0 for a scan without a point on the map."""
    rng = np.random.default_rng(seed)
    root = rng.normal(0, 1, (3, rank)) * 10 ** rng.uniform(-2, 2.5)
    found = Keyframes(OPTIONS, GAUSSIANS)
    found.add(0, room(0), tracked(rng.uniform(-3, 3, 3)))
    found.add(1, room(1), tracked(rng.uniform(-3, 3, 3), root @ root.T, path=length))
    information = relation_to_previous(found).information
    np.testing.assert_allclose(information, information.T, rtol=1e-6, atol=1e-6)
    assert np.linalg.eigvalsh(information).min() > 0
    drift = np.diag([OPTIONS.drift**2, OPTIONS.drift**2, OPTIONS.drift_angle**2]) * length
    spare = np.linalg.inv(information) - drift
    assert np.linalg.eigvalsh(spare).min() > -1e-6 * np.abs(np.linalg.inv(information)).max()


@given(st.floats(-3, 3), st.floats(-20, 20), st.floats(-20, 20))
@settings(max_examples=30, deadline=None)
def test_the_relation_does_not_depend_on_the_trackers_frame(turn, x, y):
    frame = np.array([x, y, turn])
    before, last = np.array([1.0, 2.0, 0.7]), np.array([1.5, 2.4, -0.4])
    relations = []
    for a, b, hessian in (
        (before, last, HESSIAN),
        (compose(frame, before), compose(frame, last), rotated_information(frame, HESSIAN)),
    ):
        found = Keyframes(OPTIONS, GAUSSIANS)
        found.add(0, room(0), tracked(a))
        found.add(1, room(1), tracked(b, hessian, path=0.6))
        relations.append(relation_to_previous(found))
    np.testing.assert_allclose(relations[0].measurement, relations[1].measurement, atol=1e-9)
    np.testing.assert_allclose(relations[0].information, relations[1].information, rtol=1e-6, atol=1e-3)


def test_a_match_that_says_nothing_leaves_the_motion_that_was_expected():
    """Three steps of 0.1 m and 0.05 rad (σ) each add up; drift is nothing against them."""
    step = TrackedScan(np.zeros(3), np.zeros((3, 3)), np.diag([0.01, 0.01, 0.0025]), 0.0, 0.0, False)
    found = Keyframes(OPTIONS, GAUSSIANS)
    found.add(0, room(0), step)
    attach(found, 1, step)
    attach(found, 2, step)
    found.add(3, room(3), step)
    covariance = np.linalg.inv(relation_to_previous(found).information)
    np.testing.assert_allclose(covariance, np.diag([0.03, 0.03, 0.0075]), rtol=0.01, atol=1e-9)


@pytest.mark.parametrize("curve", [-1.0, -1e3, -1e6])
def test_a_match_that_curves_down_says_nothing_in_that_direction(curve):
    """As one that was not settled: what was expected of the motion stands there alone, and drift."""
    found = Keyframes(OPTIONS, GAUSSIANS)
    found.add(0, room(0), tracked(np.zeros(3)))
    for hessian in (np.diag([9e4, curve, 1.6e5]), np.diag([9e4, 0.0, 1.6e5])):
        found.add(len(found.list), room(1), tracked(np.zeros(3), hessian, path=0.5))
    down, flat = chain_relations(found.list, found.options)
    assert np.linalg.eigvalsh(down.information)[0] > 0
    np.testing.assert_allclose(down.information[1, 1], flat.information[1, 1], rtol=0.1)
