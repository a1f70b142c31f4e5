"""Where no scan tells the way, relations are as uncertain as the guess of its length, and no others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.graph.io.tum import parse_tum
from nscan_cli.graph.marginal_covariances import marginal_covariances
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.logs.load import read_log
from nscan_cli.matching.joint.gauge import gauge_directions
from nscan_cli.poses import Array, relative
from nscan_cli.slam.backend.degenerate_relations import DegenerateStretch, length_variances
from nscan_cli.slam.backend.guessed_ways import GuessedWays
from nscan_cli.slam.backend.options import DegenerateRelationOptions
from nscan_cli.slam.diagnostics.notices import notices
from tests.data import data_file
from tests.simulation.scenes import bare_corridor
from tests.slam.mapped_logs import mapped

SIZE = 7
SURE = 1e6
"""Information (1/m², 1/rad²) of each relation along each coordinate."""


SURE_WAY = DegenerateRelationOptions(direction_sigma=0.0)


def chain() -> list[Pairwise]:
    step = np.array([2.0, 0.0, 0.0])
    return [Pairwise((k, k + 1), step, SURE * np.eye(3), "track") for k in range(SIZE - 1)]


def joint(nodes: tuple[int, ...]) -> NScan:
    """All pairs of nodes along the x axis hold each other as the chain does."""
    n = len(nodes)
    laplacian = SURE * (n * np.eye(n) - np.ones((n, n)))
    poses = np.array([(2.0 * node, 0.0, 0.0) for node in nodes])
    hessian: Array = np.kron(laplacian, np.eye(3)).astype(np.float64)
    return NScan(nodes, poses, hessian, 0, "nscan")


def widened(
    pairwise: list[Pairwise],
    nscan: list[NScan],
    variances: Array,
    options: DegenerateRelationOptions | None = None,
):
    """The relations with variances (K − 1, 3) of the guess."""
    ways = GuessedWays(np.arange(SIZE), chain(), variances, options or DegenerateRelationOptions())
    return [ways.widened_pair(pair) for pair in pairwise], [ways.widened_joint(joint) for joint in nscan]


def along_steps(*sigmas: float) -> Array:
    """(K − 1, 3) variances along the way of these standard deviations (m)."""
    return np.column_stack([np.square(sigmas), np.zeros((SIZE - 1, 2))])


def end_sigmas(pairwise: list[Pairwise], nscan: list[NScan]) -> Array:
    """(3,) of the last node."""
    ids = np.arange(SIZE)
    poses = np.array([(2.0 * k, 0.0, 0.0) for k in range(SIZE)])
    graph = Graph(ids, [f"{k}.0" for k in range(SIZE)], poses, None, ids, pairwise, nscan)
    return np.sqrt(np.diag(marginal_covariances(graph)[SIZE - 1]))


@pytest.mark.parametrize("joints", [[], [(0, 1, 2, 3), (2, 3, 4, 5), (3, 4, 5, 6)]])
def test_all_relations_together_have_the_variance_of_the_guess(joints):
    rows, times = np.arange(SIZE), np.arange(float(SIZE))
    way = DegenerateStretch(2, 5, 8.0, possible=8.0, ahead=8.0)
    variances = length_variances(rows, times, [way], DegenerateRelationOptions(speed_share=0.5))
    # Half of 8 m, over four steps.
    np.testing.assert_allclose(variances, [0.0, 4.0, 4.0, 4.0, 4.0, 0.0])
    nscan = [joint(nodes) for nodes in joints]
    along = np.column_stack([variances, np.zeros((SIZE - 1, 2))])
    x, y, _ = end_sigmas(*widened(chain(), nscan, along))
    assert x == pytest.approx(4.0, rel=0.3)
    assert y < 0.03


@pytest.mark.parametrize("joints", [[], [(0, 1, 2, 3), (2, 3, 4, 5), (3, 4, 5, 6)]])
def test_after_scans_that_fit_nothing_neither_place_nor_turn_is_known(joints):
    """Of the step from 2 to 3; the end, 6 m farther on, swings with it."""
    variances = np.zeros((SIZE - 1, 3))
    variances[2, 1:] = 0.3**2, 0.2**2
    nscan = [joint(nodes) for nodes in joints]
    x, y, turn = end_sigmas(*widened(chain(), nscan, variances))
    assert x == pytest.approx(0.3, rel=0.3)
    assert y == pytest.approx(np.hypot(0.3, 6.0 * 0.2), rel=0.3)
    assert turn == pytest.approx(0.2, rel=0.3)


def test_other_relations_and_other_visits_stay():
    variances = along_steps(0.0, 0.0, 3.0, 0.0, 0.0, 0.0)
    loop = Pairwise((1, 6), np.array([10.0, 0.0, 0.0]), SURE * np.eye(3), "loop")
    known, _ = widened([*chain(), loop], [], variances)
    changed = [k for k, (old, new) in enumerate(zip([*chain(), loop], known, strict=True)) if old is not new]
    assert len(known) == SIZE
    assert [known[k].nodes for k in changed if known[k].information[0, 0] < SURE] == [(2, 3)]
    assert known[2].information[0, 0] == pytest.approx(1.0 / 9.0, rel=1e-3)
    # Across it is as certain as the direction of the way.
    across = DegenerateRelationOptions().direction_sigma * 3.0
    assert known[2].information[1, 1] == pytest.approx(1.0 / (1.0 / SURE + across**2), rel=1e-3)


def test_a_way_that_is_mapped_unlike_the_usual_one_is_less_certain():
    """The robot seems to go back by 1 m where it usually goes on by 8 m: the map is likely wrong by 9 m."""
    rows, times = np.arange(SIZE), np.arange(float(SIZE))
    steady, reversed_ = (DegenerateStretch(2, 5, 8.0, possible=8.0, ahead=ahead) for ahead in (8.0, -1.0))
    options = DegenerateRelationOptions(speed_share=0.5)
    sigmas = [np.sqrt(length_variances(rows, times, [way], options).sum()) for way in (steady, reversed_)]
    np.testing.assert_allclose(sigmas, [4.0, np.hypot(4.0, 9.0)])


def test_joint_matches_that_draw_a_guessed_way_together_get_its_length():
    drawn = joint((0, 1, 2, 3))
    drawn = replace(drawn, poses=np.array([(0.0, 0, 0), (2.0, 0, 0), (2.1, 0.01, 0), (4.1, 0.01, 0)]))
    _, [found] = widened([], [drawn], along_steps(0.0, 3.0, 0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(found.poses[:, 0], [0.0, 2.0, 4.0, 6.0], atol=1e-6)
    np.testing.assert_allclose(found.poses[:, 1], [0.0, 0.0, 0.01, 0.01], atol=1e-6)


def test_the_gauge_of_a_joint_match_moves_with_its_scans():
    """With the null space of the scans where they were, no turn of the whole would be free."""
    gauge = gauge_directions(poses := np.array([(1.5 * k, 0.1 * k, 0.1 * k) for k in range(4)]))
    free = np.eye(12) - gauge @ np.linalg.pinv(gauge)
    drawn = replace(joint((0, 1, 2, 3)), poses=poses, hessian=SURE * free)
    _, [found] = widened([], [drawn], along_steps(0.0, 3.0, 0.0, 0.0, 0.0, 0.0))
    assert np.abs(found.poses - poses).max() > 0.01
    np.testing.assert_allclose(found.hessian @ gauge_directions(found.poses), 0.0, atol=1e-6 * SURE)


def test_relations_whose_directions_differ_do_not_fix_the_length():
    """They cross like needles: what they know across made the length certain."""
    sigmas, ways = (5.0,) * (SIZE - 1), []
    for turn in (-0.002, 0.002):
        for nodes in ((0, 1, 2, 3), (3, 4, 5, 6)):
            found = joint(nodes)
            turned = found.poses + np.array([(0, 0, 0), *((0, 0, turn),) * 3])
            ways.append(replace(found, poses=turned))
    whole = 5.0 * np.sqrt(SIZE - 1)
    held, _, _ = end_sigmas(*widened(chain(), ways, along_steps(*sigmas), SURE_WAY))
    free, _, _ = end_sigmas(*widened(chain(), ways, along_steps(*sigmas)))
    assert held < 0.8 * free
    assert free == pytest.approx(whole, rel=0.4)


@pytest.mark.parametrize(("guessed", "is_held"), [(range(6), False), (range(3), False), (range(1, 5), True)])
def test_scans_within_a_guessed_way_tell_no_place_on_another_visit_either(guessed: range, is_held: bool):
    """A robot that only seems to have turned back sees the same walls, and any match fits."""
    loop = Pairwise((0, 6), np.zeros(3), SURE * np.eye(3), "loop")
    variances = along_steps(*(3.0 * (k in guessed) for k in range(SIZE - 1)))
    [pair], [revisit] = widened([loop], [joint((0, 6))], variances)
    for information in (pair.information[0, 0], revisit.hessian[3, 3]):
        assert (information > 0.9 * SURE) == is_held
        assert is_held or information < 1e-3


@pytest.mark.parametrize("seed", [31, 32, 33])
def test_a_bare_corridor_is_not_drawn_together(seed: int):
    """Odometry ends at a third: joint matches put keyframes 9 m apart on one spot, at half of the sigma."""
    recording = bare_corridor().record(seed)
    log = recording.log()
    assert log.odometry is not None
    odometry = log.odometry.copy()
    odometry[len(log) // 3 :] = np.nan
    run = mapped(replace(log, odometry=odometry, odometry_path=None))
    keyframes = run.graph.keyframes
    drawn, driven = (
        np.hypot(*np.diff(path[keyframes, :2], axis=0).T)
        for path in (run.graph.poses, np.concatenate(run.state.tracked))
    )
    np.testing.assert_allclose(drawn, driven, atol=0.3)
    error = float(
        np.hypot(*(run.graph.poses - relative(recording.truth, recording.truth[0]))[keyframes[-1], :2])
    )
    sigma = float(np.sqrt(np.linalg.eigvalsh(run.graph.marginals[int(keyframes[-1])][:2, :2])[-1]))
    assert sigma > 0.5 * error


def test_sigma_grows_where_odometry_ends_in_a_bare_corridor():
    """At the end the path is 6.5 m short and more; sigma was 0.86 m."""
    name = "strangers/corridor-odometry-ends.mcap"
    found = mapped(read_log(str(data_file(name))))
    truth = parse_tum(data_file("strangers/corridor.tum").read_bytes(), "corridor.tum").poses
    poses, last = found.graph.poses, int(found.graph.keyframes[-1])
    off = relative(poses[last], poses[0]) - relative(truth[last], truth[0])
    error = float(np.hypot(*off[:2]))
    sigma = np.sqrt(np.linalg.eigvalsh(found.graph.marginals[last][:2, :2])[-1])
    assert error > 3.0
    assert 0.5 * error < sigma < 3.0 * error
    # Before its odometry ends it is as certain as ever.
    early = next(k for k in found.graph.keyframes.tolist() if k > 100)
    assert np.sqrt(np.linalg.eigvalsh(found.graph.marginals[early][:2, :2])[-1]) < 0.6
    assert any("the walls do not show how far the robot went" in said for said in notices(found.state))
