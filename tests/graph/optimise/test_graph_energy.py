from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.poses import compose
from tests.graph.reference_terms import derivative, second_derivative, term
from tests.graph.simulated_relations import dense_matrix, disturbed, energy_of, mixed_ring, nscan_relation


@pytest.mark.parametrize("fixed", [0, 3, 7])
def test_the_system_is_the_plain_sum_of_all_terms(fixed: int):
    truth, pairwise, nscan = mixed_ring(8, noise=1.0)
    nscan.append(nscan_relation(truth, [6, 1, 4], np.random.default_rng(5), 1.0))
    poses = disturbed(truth, 0.3)
    relations: list[Pairwise | NScan] = [*pairwise, *nscan]

    def total(x: Any) -> Any:
        return sum(term(x[list(relation.nodes)], relation) for relation in relations)

    energy = energy_of(poses, pairwise, nscan, fixed)
    system = energy.evaluate(poses, exact=True)
    free = np.delete(np.arange(24), slice(3 * fixed, 3 * fixed + 3))
    expected = [term(poses[list(relation.nodes)], relation) for relation in relations]
    np.testing.assert_allclose(system.terms, expected, rtol=1e-10)
    assert system.value == pytest.approx(total(poses), rel=1e-12)
    gradient = derivative(total, poses)[free]
    np.testing.assert_allclose(system.gradient.ravel(), gradient, rtol=0, atol=1e-11 * np.abs(gradient).max())
    hessian = second_derivative(total, poses)[np.ix_(free, free)]
    scale = np.abs(hessian).max()
    np.testing.assert_allclose(dense_matrix(energy, system.hessian), hessian, rtol=0, atol=1e-8 * scale)
    part = dense_matrix(energy, energy.evaluate(poses, exact=False).hessian)
    assert np.abs(part - hessian).max() > 1e-4 * scale
    assert np.linalg.eigvalsh(part)[0] > 0


def test_node_ids_are_mapped_to_places():
    truth, pairwise, nscan = mixed_ring(8, noise=1.0)
    poses = disturbed(truth, 0.3)
    plain = energy_of(poses, pairwise, nscan).evaluate(poses, exact=True)
    places = np.array([2, 0, 3, 1, 7, 6, 5, 4])
    mixed_energy = GraphEnergy(8, [*pairwise, *nscan], places, fixed=2)
    mixed = mixed_energy.evaluate(poses[np.argsort(places)], exact=True)
    np.testing.assert_allclose(mixed.terms, plain.terms, rtol=1e-12)
    np.testing.assert_allclose(mixed.gradient[[0, 2, 1]], plain.gradient[[0, 1, 2]], rtol=1e-9, atol=1e-9)


def test_the_energy_does_not_change_with_the_frame():
    truth, pairwise, nscan = mixed_ring(8, noise=1.0)
    poses = disturbed(truth, 0.3)
    energy = energy_of(poses, pairwise, nscan)
    terms = energy.evaluate(poses, exact=False).terms
    moved = compose(np.array([30.0, -4.0, 2.5]), poses)
    np.testing.assert_allclose(energy.evaluate(moved, exact=False).terms, terms, rtol=1e-9)


def test_a_graph_without_relations_has_no_energy():
    system = energy_of(np.zeros((3, 3)), [], []).evaluate(np.ones((3, 3)), exact=True)
    assert (system.value, system.terms.shape) == (0.0, (0,))
    np.testing.assert_array_equal(system.gradient, np.zeros((2, 3)))


def test_the_terms_alone_are_those_of_the_system():
    truth, pairwise, nscan = mixed_ring(8, noise=1.0)
    poses = disturbed(truth, 0.3)
    energy = energy_of(poses, pairwise, nscan)
    weights = np.linspace(0.5, 1.5, len(pairwise) + len(nscan))
    plain, weighted = (
        energy.evaluate(poses, exact=False),
        energy.weighted(weights).evaluate(poses, exact=False),
    )
    np.testing.assert_allclose(energy.terms(poses), plain.terms, rtol=1e-12)
    np.testing.assert_allclose(weighted.terms, weights * plain.terms, rtol=1e-12)
    np.testing.assert_allclose(energy.weighted(weights).terms(poses), weighted.terms, rtol=1e-12)


def test_a_weight_counts_in_all_derivatives():
    truth, pairwise, nscan = mixed_ring(8, noise=1.0)
    poses = disturbed(truth, 0.3)
    energy = energy_of(poses, pairwise, nscan)
    count = len(pairwise) + len(nscan)
    parts = [energy.weighted(np.eye(count)[k]).evaluate(poses, exact=True) for k in range(count)]
    weights = np.linspace(0.5, 1.5, count)
    whole = energy.weighted(weights).evaluate(poses, exact=True)
    for name in ("gradient", "hessian"):
        total = sum(weight * getattr(part, name) for weight, part in zip(weights, parts, strict=True))
        np.testing.assert_allclose(getattr(whole, name), total, rtol=1e-9, atol=1e-9 * np.abs(total).max())
