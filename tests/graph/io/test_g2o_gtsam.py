"""Our g2o files read and optimised by GTSAM.

GTSAM's own factor has Log(z⁻¹ ∘ x_i⁻¹ ∘ x_j) for its error, g2o's edge the components of the same pose. They
differ in the second order: on real graphs by some 1e-5 of χ². So the proof is by factors with g2o's error
and the measurements and noise models as GTSAM's reader has them; GTSAM's own are compared loosely.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.graph_solver import Optimum, StopOptions
from nscan_cli.graph.optimise.whole_graph import WholeGraphOptions, optimise_graph
from tests.data import data_file
from tests.graph.simulated_relations import disturbed, graph_of, mixed_ring

gtsam = pytest.importorskip("gtsam", reason="gtsam is not installed: pip install nscan-cli[test]")


def optimised_file(folder: Path, graph: Graph) -> tuple[Optimum, Path]:
    """The graph as g2o, read back and brought to its minimum by us; the file of that, and the minimum."""
    path = folder / "graph.g2o"
    path.write_bytes(write_g2o(graph))
    graph = load_graph(str(path))
    optimum = optimise_graph(graph, WholeGraphOptions(StopOptions(1000, 1e-9)))
    assert optimum.converged
    path.write_bytes(write_g2o(graph))
    return optimum, path


def as_g2o_measures(factor: Any) -> Any:
    """A factor with g2o's error: the components of z⁻¹ ∘ (x_i⁻¹ ∘ x_j)."""
    z = factor.measured()

    def error(this: Any, values: Any, jacobians: list[np.ndarray] | None) -> np.ndarray:
        i, j = this.keys()
        step = values.atPose2(i).between(values.atPose2(j))
        off = z.between(step)
        if jacobians is not None:
            # GTSAM moves a pose by x ∘ Exp(δ), in the frame of the pose itself.
            turned = np.eye(3)
            turned[:2, :2] = off.rotation().matrix()
            jacobians[0] = -turned @ step.inverse().AdjointMap()
            jacobians[1] = turned
        return np.array([off.x(), off.y(), off.theta()])

    return gtsam.CustomFactor(factor.noiseModel(), list(factor.keys()), error)


def read_by_gtsam(path: Path) -> tuple[Any, Any, Any]:
    """GTSAM's own factors, those with g2o's error, and the poses of the file."""
    own, poses = gtsam.readG2o(str(path), False)
    as_g2o = gtsam.NonlinearFactorGraph()
    for k in range(own.size()):
        as_g2o.add(as_g2o_measures(own.at(k)))
    return own, as_g2o, poses


def moved(factors: Any, poses: Any) -> tuple[float, float]:
    """How far (m, rad) GTSAM's Levenberg–Marquardt moves a pose; the first one is held."""
    first = min(poses.keys())
    held = gtsam.NonlinearFactorGraph(factors)
    held.add(gtsam.NonlinearEqualityPose2(first, poses.atPose2(first)))
    options = gtsam.LevenbergMarquardtParams()
    options.setRelativeErrorTol(1e-15)
    options.setAbsoluteErrorTol(1e-15)
    found = gtsam.LevenbergMarquardtOptimizer(held, poses, options).optimize()
    keys = list(poses.keys())
    steps = [poses.atPose2(key).between(found.atPose2(key)) for key in keys]
    return max(np.hypot(step.x(), step.y()) for step in steps), max(abs(step.theta()) for step in steps)


def simulated_graph() -> Graph:
    """A ring of pairwise and nScan relations with noise, its poses disturbed; ids are no rows."""
    truth, pairwise, nscan = mixed_ring(24, noise=1.0, seed=4)
    graph = graph_of(disturbed(truth, 0.05), pairwise, nscan)
    graph.scans = 7 * graph.scans + 3
    return graph


def assert_gtsam_agrees(optimum: Optimum, path: Path, gap: float, step: float) -> None:
    """`gap` is what GTSAM's own error may differ by, relatively; `step` (m) what it may move for that."""
    own, as_g2o, poses = read_by_gtsam(path)
    graph = load_graph(str(path))
    assert (own.size(), poses.size()) == (len(graph.pairwise), len(graph))
    assert 2 * as_g2o.error(poses) == pytest.approx(optimum.energy, rel=1e-6)
    distance, turn = moved(as_g2o, poses)
    assert distance < 1e-6
    assert turn < 1e-6
    assert 2 * own.error(poses) == pytest.approx(optimum.energy, rel=gap)
    assert moved(own, poses)[0] < step


def test_gtsam_reports_our_minimum_and_stays_there(tmp_path: Path):
    optimum, path = optimised_file(tmp_path, simulated_graph())
    assert optimum.energy > 10
    assert_gtsam_agrees(optimum, path, gap=1e-2, step=5e-3)


def test_a_worse_start_is_moved_to_our_minimum(tmp_path: Path):
    """What does not move has to be able to."""
    optimum, path = optimised_file(tmp_path, simulated_graph())
    graph = load_graph(str(path))
    best = graph.poses
    graph.poses = disturbed(best, 0.02)
    path.write_bytes(write_g2o(graph))
    _, as_g2o, poses = read_by_gtsam(path)
    assert 2 * as_g2o.error(poses) > 1.5 * optimum.energy
    off = np.hypot(*(graph.poses - best)[:, :2].T).max()
    assert moved(as_g2o, poses)[0] == pytest.approx(off, rel=0.3)


def test_gtsam_reads_a_relation_that_leaves_a_direction_open(tmp_path: Path):
    """Its noise models are factorised after Cholesky: rounding must not make them indefinite."""
    graph = simulated_graph()
    for relation in graph.nscan:
        slide = np.tile([1.0, 0.2, 0.0], len(relation.nodes) - 1)
        slide /= np.linalg.norm(slide)
        others = np.delete(
            np.arange(3 * len(relation.nodes)), slice(3 * relation.fixed, 3 * relation.fixed + 3)
        )
        open_to = np.eye(len(slide)) - np.outer(slide, slide)
        block = np.ix_(others, others)
        relation.hessian[block] = open_to @ relation.hessian[block] @ open_to
    path = tmp_path / "graph.g2o"
    path.write_bytes(write_g2o(graph))
    own, _, _ = read_by_gtsam(path)
    lines = [line.split() for line in path.read_text().splitlines() if line.startswith("EDGE_SE2")]
    for k, fields in enumerate(lines):
        xx, xy, xa, yy, ya, aa = (float(field) for field in fields[6:])
        information = np.array([[xx, xy, xa], [xy, yy, ya], [xa, ya, aa]])
        assert np.linalg.eigvalsh(information)[0] > 0
        read = own.at(k).noiseModel().information()
        np.testing.assert_allclose(read, information, atol=1e-6 * np.abs(information).max())


@pytest.mark.logs
def test_gtsam_agrees_on_a_real_graph(tmp_path: Path):
    optimum, path = optimised_file(tmp_path, load_graph(str(data_file("intel.g2o"))))
    assert_gtsam_agrees(optimum, path, gap=1e-4, step=5e-3)
