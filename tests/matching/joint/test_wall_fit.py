from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.matching.joint.joint_energy import joint_energy
from nscan_cli.matching.joint.joint_match import match_near_and_far
from nscan_cli.matching.joint.options import JointOptions, WallFitOptions
from nscan_cli.matching.joint.wall_fit import PointCloud, common_walls, fit_to_walls
from nscan_cli.poses import compose
from tests.matching.problems import OPTIONS, Problem, errors, near, office_problem, problem
from tests.simulation.scenes import bare_corridor

ROWS = (2000, 2008, 2016, 2024, 2032)

WALLS = WallFitOptions()


def fitted(scans: Problem, poses: np.ndarray, fixed: int | None = None) -> np.ndarray:
    joint = scans.joint(scale=2 * OPTIONS.scale / len(scans))
    return fit_to_walls(joint.scans, poses, joint_energy(joint, poses, exact=False).hessian, fixed, WALLS)


def wall(x: np.ndarray, y: np.ndarray, robot: tuple[float, float], scan: int) -> PointCloud:
    points = np.stack([x, y], axis=1)
    return PointCloud(points, points - np.array(robot), np.full(len(x), scan))


def together(*clouds: PointCloud) -> PointCloud:
    return PointCloud(*(np.concatenate(parts) for parts in zip(*clouds, strict=True)))


def test_without_noise_poses_come_nearer_to_the_truth():
    exact = office_problem(ROWS, noise=False)
    start = near(exact.truth, 1, 0.005, 0.001)
    before, after = (np.abs(errors(poses, exact.truth)[:, :2]) for poses in (start, fitted(exact, start)))
    assert after.max() < 0.5 * before.max()


def test_the_frame_does_not_matter():
    scans = office_problem(ROWS)
    start = near(scans.truth, 2, 0.01, 0.003)
    moved = compose(np.array([3.0, -2.0, np.pi / 2]), start)
    here, there = fitted(scans, start), fitted(scans, moved)
    # Cells lie elsewhere and divide other walls.
    assert np.abs(errors(here, there)).max() < 0.003


def test_a_fixed_scan_stays_and_a_free_gauge_moves_least():
    scans = office_problem(ROWS)
    start = near(scans.truth, 3, 0.01, 0.003)
    np.testing.assert_array_equal(fitted(scans, start, 2)[2], start[2])
    free = fitted(scans, start)
    np.testing.assert_allclose((free - start)[:, :2].mean(axis=0), 0, atol=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_along_a_bare_corridor_poses_stay_where_they_were(seed):
    """Its walls say nothing of the way along it: a scan that is off is moved across it, but not along."""
    truth = np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.05], [1.0, -0.1, -0.05]])
    start = truth + np.array([[0, 0, 0], [0.1, 0.01, 0], [0, 0, 0]])
    joint = problem(bare_corridor(), truth, noise=True, seed=seed).joint(scale=0.4)
    known = joint_energy(joint, start, exact=False).hessian + np.eye(9) * 0.1**-2
    off = fit_to_walls(joint.scans, start, known, 0, WALLS) - truth
    assert off[1, 0] == pytest.approx(0.1, abs=0.05)
    assert np.abs(off[:, 1]).max() < 0.007


def test_a_wall_seen_by_two_scans_is_one_and_a_bend_is_two():
    x = np.linspace(0.0, 3.9, 40)
    line = together(wall(x, 0 * x, (1, -2), 0), wall(x, 0 * x, (2, -2), 1))
    members, ends = common_walls(line, WALLS)
    assert (sorted(members), ends.tolist()) == (list(range(80)), [80])
    bend = np.where(x < 2, 0.0, 2 * (x - 2))
    members, ends = common_walls(together(wall(x, bend, (1, -2), 0), wall(x, bend, (2, -2), 1)), WALLS)
    assert len(ends) > 1
    for first, end in zip([0, *ends[:-1]], ends, strict=True):
        part = x[members[first:end] % 40]
        assert part.max() < 2.1 or part.min() > 1.9


def test_what_one_scan_sees_alone_is_no_common_wall():
    x = np.linspace(0.0, 3.9, 40)
    assert len(common_walls(wall(x, 0 * x, (1, -2), 0), WALLS)[1]) == 0
    few = np.linspace(0.0, 0.2, WALLS.minimum // 2 - 1)
    both = together(wall(few, 0 * few, (1, -2), 0), wall(few, 0 * few, (2, -2), 1))
    assert len(common_walls(both, WALLS)[1]) == 0


def test_the_two_faces_of_a_wall_are_two_walls():
    x = np.linspace(0.0, 3.9, 40)
    faces = [wall(x, 0 * x + 0.1 * (y > 0), (1, y), scan) for scan, y in enumerate((-2, -2, 2, 2))]
    members, ends = common_walls(together(*faces), WALLS)
    assert len(ends) == 2
    assert {tuple(sorted(set(members[a:b] // 80))) for a, b in ((0, 80), (80, 160))} == {(0,), (1,)}


def test_a_match_is_more_exact_for_it():
    """Ten draws of noise and start: the mean over them of the root mean square error of the positions."""
    before: list[float] = []
    after: list[float] = []
    for seed in range(10):
        scans = office_problem(ROWS, seed=seed)
        joint = scans.joint(scale=2 * OPTIONS.scale / len(ROWS))
        match = match_near_and_far(joint, near(scans.truth, seed), JointOptions())
        fit = fit_to_walls(joint.scans, match.poses, match.hessian, None, WALLS)
        for found, poses in ((before, match.poses), (after, fit)):
            found.append(float(np.sqrt((errors(poses, scans.truth)[1:, :2] ** 2).sum(axis=1).mean())))
    assert np.mean(after) < 0.85 * np.mean(before)
