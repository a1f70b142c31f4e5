"""A type of relation is added by a class in a module and a line in RELATION_TYPES; nothing else changes."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.graph.io.g2o import parse_g2o, write_g2o
from nscan_cli.graph.io.json_fields import JsonRecord
from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.marginal_covariances import marginal_covariances
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.graduated_nonconvexity import RobustOptions, contradicting
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.whole_graph import components, optimise_graph
from nscan_cli.graph.relations.base import Term
from nscan_cli.graph.relations.registry import RELATION_TYPES
from nscan_cli.poses import Array, compose, relative
from tests.graph.reference_terms import derivative
from tests.graph.schema import validate
from tests.graph.simulated_relations import graph_of, mixed_ring, pairwise_relations, ring

COUNT = 24


@dataclass(frozen=True)
class Fix:
    """A position in the map, as a receiver of satellites gives it. Keyframe nodes[0] is where it was put."""

    kind: ClassVar[str] = "fix"
    nodes: tuple[int, int]
    held: Array
    """(3,) pose of nodes[0] in the map; no information about it is given."""
    position: Array
    """(2,) of nodes[1], m."""
    sigma: float
    """m"""
    origin: str = "track"
    score: float = 0.0

    def term(self) -> Term:
        hessian = np.zeros((6, 6))
        hessian[3, 3] = hessian[4, 4] = self.sigma**-2
        return Term(np.array([self.held, [*self.position, 0.0]]), hessian, 0)

    def content(self) -> dict[str, Any]:
        x, y = self.position.tolist()
        return {"held": self.held.tolist(), "x": x, "y": y, "sigma": self.sigma}

    @classmethod
    def from_content(cls, record: JsonRecord, nodes: tuple[int, ...], origin: str, score: float) -> Self:
        sigma = record.number("sigma")
        if sigma <= 0:
            raise record.wrong("sigma", "a length above 0")
        position = np.array([record.number("x"), record.number("y")])
        return cls((nodes[0], nodes[1]), record.pose("held"), position, sigma, origin, score)


@dataclass(frozen=True)
class Range:
    """The distance of two keyframes, as radio gives it: an error ‖t_b − t_a‖ − r that is not linear."""

    kind: ClassVar[str] = "range"
    nodes: tuple[int, int]
    metres: float
    sigma: float
    """m"""
    origin: str = "track"
    score: float = 0.0

    def term(self) -> Term:
        return Term(np.zeros((2, 3)), np.zeros((6, 6)), 0, self._at)

    def _at(self, poses: Array) -> Term:
        """r ahead in the direction in which b lies for a, and information in that direction alone."""
        seen = relative(poses[1], poses[0])[:2]
        distance = float(np.linalg.norm(seen))
        if distance < 1e-6:
            return self.term()
        ahead = seen / distance
        hessian = np.zeros((6, 6))
        hessian[3:5, 3:5] = np.outer(ahead, ahead) / self.sigma**2
        return Term(np.array([[0.0, 0.0, 0.0], [*self.metres * ahead, 0.0]]), hessian, 0)

    def content(self) -> dict[str, Any]:
        return {"metres": self.metres, "sigma": self.sigma}

    @classmethod
    def from_content(cls, record: JsonRecord, nodes: tuple[int, ...], origin: str, score: float) -> Self:
        return cls((nodes[0], nodes[1]), record.number("metres"), record.number("sigma"), origin, score)


@pytest.fixture(autouse=True)
def with_new_types(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nscan_cli.graph.relations.registry.RELATION_TYPES", [*RELATION_TYPES, Fix, Range])


def chain(poses: Array) -> Graph:
    """An open chain that is off by 1 cm and 0.01 rad from the truth at every step."""
    steps = [(a, a + 1) for a in range(len(poses) - 1)]
    exact = pairwise_relations(poses, steps, np.random.default_rng(0))
    off = np.array([0.01, 0.0, 0.01])
    graph = graph_of(poses, [replace(r, measurement=r.measurement + off, origin="track") for r in exact], [])
    optimise_graph(graph)
    return graph


def distances(graph: Graph, truth: Array) -> Array:
    off: Array = np.hypot(*(graph.poses - truth)[:, :2].T)
    return off


def test_it_is_optimised_with_the_others():
    truth = ring(COUNT)
    graph = chain(truth)
    drift = distances(graph, truth)
    assert drift[-1] > 1.0
    graph.add(Fix((0, COUNT - 1), truth[0], truth[-1, :2], 0.001))
    graph.add(Fix((0, COUNT // 2), truth[0], truth[COUNT // 2, :2], 0.001))
    found = optimise_graph(graph)
    assert found.converged
    after = distances(graph, truth)
    assert after[[COUNT // 2, -1]].max() < 0.01
    assert after.max() < 0.2 * drift.max()
    # Its χ² is that of a position by itself, (‖t − position‖ / σ)².
    (part,) = components(graph)
    terms = part.energy(COUNT).evaluate(graph.poses, exact=False).terms
    np.testing.assert_allclose(terms[-2:], (after[[-1, COUNT // 2]] / 0.001) ** 2, rtol=1e-6)
    np.testing.assert_allclose(terms.sum(), found.energy, rtol=1e-9)


def test_an_error_that_is_not_linear_has_its_own_value_and_gradient():
    rng = np.random.default_rng(4)
    poses = rng.normal(scale=3.0, size=(4, 3))
    graph = graph_of(poses, [], [])
    graph.add(Range((2, 0), 2.5, 0.3))
    graph.add(Range((1, 3), 1.5, 0.1))
    graph.add(Range((2, 3), 4.0, 0.2))
    energy = GraphEnergy(4, graph.relations, np.arange(4)).weighted(np.array([1.0, 1.0, 0.25]))

    def value(x: Any) -> Any:
        def term(a: int, b: int, metres: float, sigma: float) -> Any:
            return ((np.sqrt(((x[b] - x[a])[:2] ** 2).sum()) - metres) / sigma) ** 2

        return term(2, 0, 2.5, 0.3) + term(1, 3, 1.5, 0.1) + 0.25 * term(2, 3, 4.0, 0.2)

    system = energy.evaluate(poses, exact=False)
    assert system.value == pytest.approx(value(poses), rel=1e-12)
    expected = derivative(value, poses).reshape(4, 3)[1:]
    np.testing.assert_allclose(system.gradient, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_ranges_hold_a_chain_as_positions_do():
    truth = ring(COUNT)
    graph = chain(truth)
    drift = distances(graph, truth)
    for a, b in ((0, COUNT - 1), (0, COUNT // 2), (2, COUNT - 1), (3, COUNT // 2)):
        graph.add(Range((a, b), float(np.hypot(*(truth[b] - truth[a])[:2])), 0.001))
    assert optimise_graph(graph).converged
    assert distances(graph, truth).max() < 0.3 * drift.max()
    for held in graph.others:
        assert isinstance(held, Range)
        a, b = held.nodes
        assert np.hypot(*(graph.poses[b] - graph.poses[a])[:2]) == pytest.approx(held.metres, abs=0.002)
    back = parse_graph(write_graph(graph), "graph.json")
    assert write_graph(back) == write_graph(graph)


def test_keyframes_that_it_alone_joins_are_one_part():
    graph = graph_of(np.zeros((2, 3)), [], [])
    graph.add(Fix((0, 1), np.zeros(3), np.array([3.0, -4.0]), 0.1))
    optimise_graph(graph)
    assert len(components(graph)) == 1
    np.testing.assert_allclose(graph.poses[1, :2], [3, -4], atol=1e-9)


def test_one_that_contradicts_the_others_is_found():
    truth, pairwise, nscan = mixed_ring(COUNT, noise=1.0)
    graph = graph_of(truth, [replace(r, origin="track") for r in pairwise], nscan)
    for node in range(3, COUNT, 3):
        off = [6.0, 0.0] if node == 12 else [0.0, 0.0]
        graph.add(Fix((0, node), truth[0], truth[node, :2] + off, 0.05, origin="loop"))
    optimise_graph(graph)
    (part,) = components(graph)
    doubted = np.array([relation.origin == "loop" for relation in part.relations])
    wrong = contradicting(part.energy(COUNT), graph.poses, doubted, RobustOptions())
    assert [part.relations[k].nodes for k in np.flatnonzero(wrong)] == [(0, 12)]


def test_it_narrows_the_marginals():
    truth = ring(COUNT)
    graph = chain(truth)
    before = marginal_covariances(graph)[COUNT - 1]
    graph.add(Fix((0, COUNT - 1), truth[0], truth[-1, :2], 0.05))
    after = marginal_covariances(graph)[COUNT - 1]
    # What is known of a position by itself, and what the chain knows of it, add up as information.
    alone = np.linalg.inv(np.linalg.inv(before) + np.diag([0.05**-2, 0.05**-2, 0.0]))
    np.testing.assert_allclose(after, alone, rtol=1e-6, atol=1e-12)


def test_it_is_written_and_read_back():
    truth = ring(COUNT)
    graph = chain(truth)
    graph.add(Fix((0, 5), np.array([10.0, 0.0, 1.5]), np.array([1.5, -2.5]), 0.25, "loop", 0.5))
    data = write_graph(graph)
    line = (
        b'{"id":23,"type":"fix","nodes":[0,5],"held":[10.0,0.0,1.5],"x":1.5,"y":-2.5,"sigma":0.25,'
        b'"origin":"loop","score":0.5}\n'
    )
    assert line in data
    validate(json.loads(data))
    back = parse_graph(data, "graph.json")
    assert write_graph(back) == data
    (fix,) = back.others
    assert isinstance(fix, Fix)
    assert (fix.nodes, fix.sigma, fix.origin, fix.score) == ((0, 5), 0.25, "loop", 0.5)
    np.testing.assert_array_equal(fix.term().local, graph.others[0].term().local)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (b'"nodes":[0,5]', b'"nodes":[0,99]', r"relations\[23\]: node 99 is not a keyframe"),
        (b'"sigma":0.25', b'"sigma":0', r"relations\[23\]: 'sigma' is not a length above 0"),
        (b'"fix"', b'"fox"', "'type' is not one of pairwise, nscan, fix, range"),
    ],
)
def test_a_wrong_record_is_refused_with_its_place(old: bytes, new: bytes, problem: str):
    graph = chain(ring(COUNT))
    graph.add(Fix((0, 5), np.zeros(3), np.zeros(2), 0.25))
    data = write_graph(graph)
    assert data.count(old) == 1
    with pytest.raises(InputDataError, match=problem):
        parse_graph(data.replace(old, new), "graph.json")


def test_g2o_gets_an_edge_with_the_same_energy():
    truth = ring(COUNT)
    graph = graph_of(truth, [], [])
    graph.add(Fix((0, 5), truth[0], truth[5, :2] + [0.3, -0.1], 0.1))
    back = parse_g2o(write_g2o(graph), "graph.g2o")
    (edge,) = back.pairwise
    assert edge.nodes == (0, 5)
    # Seen from anywhere.
    moved = compose(np.array([1.0, 2.0, 0.5]), truth)
    back.poses = moved
    part = next(part for part in components(back) if len(part.keyframes) == 2)
    value = part.energy(COUNT).evaluate(moved[part.keyframes], exact=False).value
    assert value == pytest.approx((0.3**2 + 0.1**2) / 0.1**2, rel=1e-6)


def test_g2o_gets_a_range_as_it_is_at_the_poses():
    graph = graph_of(np.array([[1.0, 1.0, 0.7], [4.0, 5.0, -2.0]]), [], [])
    graph.add(Range((0, 1), 4.0, 0.5))
    back = parse_g2o(write_g2o(graph), "graph.g2o")
    part = components(back)[0]
    system = part.energy(2).evaluate(back.poses, exact=False)
    # They are 5 m apart: twice σ too far, and pulled together by 2 · 2 / 0.5.
    assert system.value == pytest.approx(4.0, rel=1e-6)
    np.testing.assert_allclose(system.gradient[0], [8 * 0.6, 8 * 0.8, 0.0], atol=1e-6)
