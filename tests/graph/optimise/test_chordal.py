from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.chordal import chordal_start
from nscan_cli.graph.optimise.graph_solver import StopOptions, optimise_poses
from nscan_cli.poses import relative
from tests.graph.simulated_relations import (
    energy_of,
    mixed_ring,
    nscan_relation,
    pairwise_relations,
    ring,
    ring_edges,
)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(6, 30), st.integers(0, 5))
def test_exact_relations_give_the_truth_at_once(seed: int, count: int, fixed: int):
    truth, pairwise, nscan = mixed_ring(count, noise=0.0, seed=seed)
    energy = energy_of(truth, pairwise, nscan, fixed)
    # Only the fixed pose is looked at.
    given_poses = np.full_like(truth, 1e3)
    given_poses[fixed] = truth[fixed]
    np.testing.assert_allclose(relative(chordal_start(energy, given_poses), truth), 0, atol=1e-7)


@pytest.mark.parametrize("kind", ["both", "nscan"])
def test_it_finds_the_minimum_where_the_given_poses_end_in_another(kind: str):
    truth, pairwise, nscan = mixed_ring(60, noise=1.0)
    if kind == "nscan":
        rng = np.random.default_rng(2)
        pairwise = []
        nscan = [nscan_relation(truth, [(i + k) % 60 for k in range(3)], rng, 1.0) for i in range(60)]
    energy = energy_of(truth, pairwise, nscan)
    best = optimise_poses(energy, truth)
    # A start that winds round twice.
    wound = ring(60)
    wound[:, 2] = wound[0, 2] + 2 * (wound[:, 2] - wound[0, 2])
    wound[1:, :2] = wound[0, :2] + np.cumsum(np.stack([np.cos(wound[:-1, 2]), np.sin(wound[:-1, 2])], 1), 0)
    assert optimise_poses(energy, wound, StopOptions(200)).energy > 10 * best.energy
    found = optimise_poses(energy, chordal_start(energy, wound))
    assert found.energy == pytest.approx(best.energy, rel=1e-9)
    np.testing.assert_allclose(relative(found.poses, best.poses), 0, atol=1e-5)


def test_one_large_error_of_the_odometry_is_undone():
    rng = np.random.default_rng(3)
    truth = ring(40)
    pairwise = pairwise_relations(truth, ring_edges(40), rng, 1.0)
    pairwise += pairwise_relations(truth, [(i, (i + 17) % 40) for i in range(0, 40, 3)], rng, 1.0)
    energy = energy_of(truth, pairwise, [])
    start = rng.normal(size=(40, 3)) * [30, 30, 3]
    start[0] = truth[0]
    found, best = optimise_poses(energy, chordal_start(energy, start)), optimise_poses(energy, truth)
    assert found.energy == pytest.approx(best.energy, rel=1e-9)


def test_relations_that_leave_directions_open_give_finite_poses():
    truth, pairwise, nscan = mixed_ring(10, noise=1.0)
    pairwise = [Pairwise(r.nodes, r.measurement, np.diag([1.0, 0, 0]), r.origin) for r in pairwise]
    nscan = [NScan(r.nodes, r.poses, 0 * r.hessian, r.fixed, r.origin) for r in nscan]
    assert np.isfinite(chordal_start(energy_of(truth, pairwise, nscan), truth)).all()
