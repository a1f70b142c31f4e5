"""Wrong loops among right ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.graduated_nonconvexity import (
    RobustOptions,
    chi2_bounds,
    chi2_by_three,
    contradicting,
    unfolded,
)
from nscan_cli.graph.optimise.graph_solver import optimise_poses
from nscan_cli.graph.optimise.whole_graph import WholeGraphOptions
from nscan_cli.poses import relative
from tests.graph.simulated_relations import (
    energy_of,
    mixed_ring,
    nscan_relation,
    pairwise_relations,
    ring,
    ring_edges,
)

COUNT = 60
LOOPS, EVERY = RobustOptions(), WholeGraphOptions().unfolding
TRUE_LOOPS = [(a, a + 30) for a in range(0, 30, 3)]


SURE = np.array([0.02, 0.02, 0.004])
"""m, m, rad: the standard deviations of all relations."""


def measured(a: int, b: int, rng: np.random.Generator, origin: str) -> Pairwise:
    truth = ring(COUNT)
    noise = SURE * rng.normal(size=3)
    return Pairwise((a, b), relative(truth[b], truth[a]) + noise, np.diag(SURE**-2), origin)


def with_loops(wrong: int, seed: int) -> tuple[list[Pairwise], list[bool]]:
    """A ring of 63 m as an open chain, ten right loops across it, and some that are 3 m off or more."""
    rng = np.random.default_rng(seed)
    chain = [measured(a, b, rng, "track") for a, b in ring_edges(COUNT)[:-1]]
    loops = [measured(a, b, rng, "loop") for a, b in TRUE_LOOPS]
    for _ in range(wrong):
        a, b = sorted(rng.choice(COUNT, 2, replace=False).tolist())
        off = np.append(rng.uniform(3.0, 8.0, 2) * rng.choice([-1, 1], 2), rng.normal(0.0, 0.5))
        loop = measured(a, b, rng, "loop")
        loops.append(replace(loop, measurement=loop.measurement + off))
    relations = chain + loops
    return relations, [False] * (len(chain) + len(TRUE_LOOPS)) + [True] * wrong


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("wrong", [1, 3, 6])
def test_the_wrong_loops_are_found_and_no_right_one(wrong, seed):
    relations, expected = with_loops(wrong, seed)
    energy = energy_of(ring(COUNT), relations, [])
    poses = optimise_poses(energy, ring(COUNT)).poses
    doubted = np.array([relation.origin == "loop" for relation in relations])
    assert contradicting(energy, poses, doubted, LOOPS).tolist() == expected


@pytest.mark.parametrize(
    ("seed", "off"), [(278, 1.0), (193, 2.0), *((seed, off) for seed in range(6) for off in (1.0, 2.0))]
)
def test_those_named_are_the_ones_beyond_the_bound_without_them(seed, off):
    """Loops that are off by little more than they may be: the last weights lead to other poses still.

    Of the first two seeds, the weights from before that keep one beyond the bound, and name one within.
    """
    count, rng = 12, np.random.default_rng(seed)
    truth = ring(count)

    def edge(a: int, b: int, origin: str) -> Pairwise:
        noise = SURE * rng.normal(size=3)
        return Pairwise((a, b), relative(truth[b], truth[a]) + noise, np.diag(SURE**-2), origin)

    relations = [edge(a, b, "track") for a, b in ring_edges(count)[:-1]]
    for _ in range(5):
        a, b = sorted(rng.choice(count, 2, replace=False).tolist())
        loop = edge(a, b, "loop")
        wrong = rng.normal(size=3) * np.array([0.15, 0.15, 0.03]) * off
        relations.append(replace(loop, measurement=loop.measurement + wrong))
    energy = energy_of(truth, relations, [])
    poses = optimise_poses(energy, truth).poses
    doubted = np.array([relation.origin == "loop" for relation in relations])
    named = contradicting(energy, poses, doubted, LOOPS)
    kept = [relation for relation, wrong in zip(relations, named, strict=True) if not wrong]
    without = optimise_poses(energy_of(truth, kept, []), poses).poses
    beyond = energy.terms(without) > chi2_bounds(energy, LOOPS)
    np.testing.assert_array_equal(named, doubted & beyond)


def test_a_wrong_joint_relation_is_found():
    truth = ring(COUNT)
    rng = np.random.default_rng(5)
    right = [nscan_relation(truth, (a, a + 1, a + 30), rng, 1.0) for a in range(0, 28, 3)]
    wrong = nscan_relation(truth, (2, 3, 47), rng, 1.0)
    wrong = replace(wrong, poses=wrong.poses + np.array([[0, 0, 0], [0, 0, 0], [6.0, 0, 0]]))
    chain = pairwise_relations(truth, ring_edges(COUNT)[:-1], rng, 1.0)
    nscan: list[NScan] = [*right, wrong]
    energy = energy_of(truth, chain, nscan)
    poses = optimise_poses(energy, truth).poses
    doubted = np.array([False] * len(chain) + [True] * len(nscan))
    assert np.flatnonzero(contradicting(energy, poses, doubted, LOOPS)).tolist() == [len(doubted) - 1]


def test_a_visit_that_is_off_as_a_whole_shows_in_a_relation_of_many_scans():
    """Six scans, three of either visit, and one of the visits is off by as much as makes a χ² of 200.

    For 15 degrees of freedom that is five times the 99.9 % quantile, 37.7. Divided by five, as if each scan
    had been off by itself, it would be 40, and within three times the 16.3 of three degrees.
    """
    truth = ring(COUNT)
    rng = np.random.default_rng(5)
    members = (2, 3, 4, 32, 33, 34)
    right = [nscan_relation(truth, (a, a + 1, a + 30, a + 31), rng) for a in (0, 6, 12, 18, 24)]
    joint = nscan_relation(truth, members, rng)
    shift = np.zeros((6, 3))
    shift[3:, 0] = 1.0
    shift *= np.sqrt(200 / (shift.ravel() @ joint.hessian @ shift.ravel()))
    wrong = replace(joint, poses=joint.poses + shift)
    chain = pairwise_relations(truth, ring_edges(COUNT)[:-1], rng)
    energy = energy_of(truth, chain, [*right, wrong])
    doubted = np.array([False] * len(chain) + [True] * 6)
    assert energy.terms(truth)[-1] == pytest.approx(200, rel=1e-6)
    weighed = energy.weighted(np.where(np.arange(len(doubted)) < len(doubted) - 1, 100.0, 1.0))
    assert np.flatnonzero(contradicting(weighed, truth, doubted, LOOPS)).tolist() == [len(doubted) - 1]


def test_quantiles_are_those_of_chi2():
    truth, pairwise, nscan = mixed_ring(12, noise=1.0)
    energy = energy_of(truth, pairwise, nscan)
    freedom = 3 * (np.array([2] * len(pairwise) + [len(relation.nodes) for relation in nscan]) - 1)
    assert len(set(freedom)) > 1
    loops, every = chi2_bounds(energy, LOOPS), chi2_bounds(energy, EVERY)
    np.testing.assert_allclose(loops, 3.0 * chi2.ppf(0.999, freedom), rtol=1e-9)
    np.testing.assert_allclose(every, chi2.ppf(0.95, freedom), rtol=1e-9)


def test_where_all_relations_fit_there_is_no_other_start():
    truth, pairwise, nscan = mixed_ring(12, noise=0.3)
    energy = energy_of(truth, pairwise, nscan)
    assert unfolded(energy, optimise_poses(energy, truth).poses, EVERY) is None


def test_a_chi2_beyond_all_numbers_is_no_reason_to_narrow_for_ever():
    truth, pairwise, nscan = mixed_ring(12, noise=0.3)
    energy = energy_of(truth, pairwise, nscan).weighted(np.full(len(pairwise) + len(nscan), np.inf))
    assert not np.isfinite(energy.terms(truth)).all()
    assert unfolded(energy, truth, EVERY) is None
    assert not contradicting(energy, truth, np.ones(len(pairwise) + len(nscan), dtype=bool), LOOPS).any()


def test_what_is_not_doubted_is_never_named():
    relations, _ = with_loops(3, seed=1)
    energy = energy_of(ring(COUNT), relations, [])
    poses = optimise_poses(energy, ring(COUNT)).poses
    assert (energy.terms(poses) / chi2_bounds(energy, LOOPS)).max() > 1.0
    assert not contradicting(energy, poses, np.zeros(len(relations), dtype=bool), LOOPS).any()


def test_weights_multiply_the_terms():
    truth, pairwise, nscan = mixed_ring(12, noise=1.0)
    energy = energy_of(truth, pairwise, nscan)
    weights = np.linspace(0.1, 2.0, len(pairwise) + len(nscan))
    whole, weighted = energy.evaluate(truth, exact=True), energy.weighted(weights).evaluate(truth, exact=True)
    np.testing.assert_allclose(weighted.terms, weights * whole.terms, rtol=1e-12)
    single = [
        energy.weighted(np.eye(len(weights))[k]).evaluate(truth, exact=True) for k in range(len(weights))
    ]
    gradient = sum(weight * each.gradient for weight, each in zip(weights, single, strict=True))
    np.testing.assert_allclose(weighted.gradient, gradient, rtol=1e-9, atol=1e-9 * np.abs(gradient).max())
    hessian = sum(weight * each.hessian for weight, each in zip(weights, single, strict=True))
    np.testing.assert_allclose(weighted.hessian, hessian, rtol=1e-9, atol=1e-9 * np.abs(hessian).max())
    # The energy itself is as before.
    assert energy.evaluate(truth, exact=True).value == whole.value


def test_chi2_is_by_three_degrees_of_freedom():
    truth, pairwise, nscan = mixed_ring(12, noise=1.0)
    energy = energy_of(truth, pairwise, nscan)
    terms = energy.evaluate(truth, exact=False).terms
    sizes = [2] * len(pairwise) + [len(relation.nodes) for relation in nscan]
    np.testing.assert_allclose(chi2_by_three(energy, truth), terms / (np.array(sizes) - 1))
