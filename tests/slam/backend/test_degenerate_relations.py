"""Where no scan tells the way, relations are as uncertain as the guess of its length, and no others."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.graph.io.tum import parse_tum
from nscan_cli.graph.marginal_covariances import marginal_covariances
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.logs.load import read_log
from nscan_cli.poses import Array, relative
from nscan_cli.slam.backend.degenerate_relations import (
    DegenerateStretch,
    length_variances,
    with_guess_variances,
)
from nscan_cli.slam.backend.options import DegenerateRelationOptions
from nscan_cli.slam.diagnostics.notices import notices
from tests.data import data_file
from tests.slam.mapped_logs import mapped

SIZE = 7
SURE = 1e6
"""Information (1/m², 1/rad²) of each relation along each coordinate."""


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


def end_sigmas(pairwise: list[Pairwise], nscan: list[NScan]) -> Array:
    """(3,) of the last node."""
    ids = np.arange(SIZE)
    poses = np.array([(2.0 * k, 0.0, 0.0) for k in range(SIZE)])
    graph = Graph(ids, [f"{k}.0" for k in range(SIZE)], poses, None, ids, pairwise, nscan)
    return np.sqrt(np.diag(marginal_covariances(graph)[SIZE - 1]))


@pytest.mark.parametrize("joints", [[], [(0, 1, 2, 3), (2, 3, 4, 5), (3, 4, 5, 6)]])
def test_all_relations_together_have_the_variance_of_the_guess(joints):
    rows, times = np.arange(SIZE), np.arange(float(SIZE))
    way = DegenerateStretch(2, 5, 6.0, possible=8.0)
    variances = length_variances(rows, times, [way], DegenerateRelationOptions(speed_share=0.5))
    # Half of 8 m, over four steps.
    np.testing.assert_allclose(variances, [0.0, 4.0, 4.0, 4.0, 4.0, 0.0])
    nscan = [joint(nodes) for nodes in joints]
    along = np.column_stack([variances, np.zeros((SIZE - 1, 2))])
    x, y, _ = end_sigmas(*with_guess_variances(chain(), nscan, rows, along, 3))
    assert x == pytest.approx(4.0, rel=0.3)
    assert y < 0.02


@pytest.mark.parametrize("joints", [[], [(0, 1, 2, 3), (2, 3, 4, 5), (3, 4, 5, 6)]])
def test_after_scans_that_fit_nothing_neither_place_nor_turn_is_known(joints):
    """Of the step from 2 to 3; the end, 6 m farther on, swings with it."""
    rows, variances = np.arange(SIZE), np.zeros((SIZE - 1, 3))
    variances[2, 1:] = 0.3**2, 0.2**2
    nscan = [joint(nodes) for nodes in joints]
    x, y, turn = end_sigmas(*with_guess_variances(chain(), nscan, rows, variances, 3))
    assert x == pytest.approx(0.3, rel=0.3)
    assert y == pytest.approx(np.hypot(0.3, 6.0 * 0.2), rel=0.3)
    assert turn == pytest.approx(0.2, rel=0.3)


def test_other_relations_and_other_visits_stay():
    rows, variances = np.arange(SIZE), np.zeros((SIZE - 1, 3))
    variances[2, 0] = 9.0
    loop = Pairwise((1, 6), np.array([10.0, 0.0, 0.0]), SURE * np.eye(3), "loop")
    known, _ = with_guess_variances([*chain(), loop], [], rows, variances, 3)
    changed = [k for k, (old, new) in enumerate(zip([*chain(), loop], known, strict=True)) if old is not new]
    assert len(known) == SIZE
    assert [known[k].nodes for k in changed if known[k].information[0, 0] < SURE] == [(2, 3)]
    assert known[2].information[0, 0] == pytest.approx(1.0 / 9.0, rel=1e-3)
    assert known[2].information[1, 1] == pytest.approx(SURE)


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
