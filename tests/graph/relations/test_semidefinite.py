"""Information that is singular to the digits written, on its way from files into energies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.io.g2o import parse_g2o, write_g2o
from nscan_cli.graph.io.json_fields import six_digits
from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.io.symmetric_matrices import upper_triangle
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import StopOptions
from nscan_cli.graph.optimise.whole_graph import WholeGraphOptions, optimise_graph
from nscan_cli.graph.relations.semidefinite import IndefiniteError, as_information, semidefinite
from nscan_cli.poses import Array, compose, inverse, relative, rotated_information
from tests.graph.simulated_relations import disturbed, graph_of, pairwise_relations, ring, ring_edges


@st.composite
def singular(draw: st.DrawFn, size: int) -> Array:
    """Positive semi-definite of some rank, in units that differ by up to a million."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    root = rng.normal(size=(size, draw(st.integers(1, size)))) * 10.0 ** rng.uniform(-3, 3, (size, 1))
    return root @ root.T


def as_written(matrix: Array) -> Array:
    """With six significant digits."""
    return np.array([six_digits(entry) for entry in matrix.ravel().tolist()]).reshape(matrix.shape)


@settings(max_examples=200, deadline=None)
@given(st.sampled_from([2, 3, 6, 15]).flatmap(singular))
def test_what_was_semidefinite_before_it_was_written_is_taken(matrix):
    written = as_written(matrix)
    (sound,) = semidefinite(written[None])
    trace = np.trace(written)
    assert np.linalg.eigvalsh(sound)[0] >= -1e-12 * trace
    # It is moved by no more than rounding had moved it.
    assert np.abs(sound - written).max() <= 5e-6 * trace


@settings(max_examples=100, deadline=None)
@given(st.sampled_from([3, 6]).flatmap(singular), st.floats(1e-3, 1.0))
def test_what_was_not_is_refused(matrix, share):
    values, vectors = np.linalg.eigh(matrix)
    values[0] = -share * values[-1]
    wrong = as_written((vectors * values) @ vectors.T)
    sound = np.eye(len(matrix))
    with pytest.raises(IndefiniteError, match="has a negative eigenvalue") as error:
        semidefinite(np.stack([sound, sound, wrong, sound]))
    assert error.value.index == 2
    # A match has no curvature there; it is no error of anybody's.
    np.testing.assert_allclose(
        np.linalg.eigvalsh(as_information(wrong)),
        np.maximum(np.linalg.eigvalsh(wrong), 0),
        atol=1e-9 * trace_of(wrong),
    )


def trace_of(matrix: Array) -> float:
    return float(np.abs(np.linalg.eigvalsh(matrix)).sum())


@pytest.mark.parametrize(
    "matrix",
    [
        np.zeros((3, 3)),
        np.diag([4.0, 0.0, 9.0]),
        np.array([[100.0, 100.0, 0.0], [100.0, 100.0, 0.0], [0.0, 0.0, 400.0]]),
        np.outer([0.1, 0.2, 0.3], [0.1, 0.2, 0.3]),
        np.diag([1e-9, 1.0, 1e30]),
    ],
)
def test_a_sound_matrix_is_the_same_bit_for_bit(matrix):
    # Beside one that is mended.
    mended = np.diag([1.0, 1.0, -1e-7])
    sound = semidefinite(np.stack([matrix, mended]))
    assert sound[0].tobytes() == matrix.tobytes()
    np.testing.assert_allclose(sound[1], np.diag([1.0, 1.0, 0.0]), atol=1e-15)
    assert as_information(matrix).tobytes() == matrix.tobytes()


def g2o_of(poses: Array, edges: list[Pairwise], digits: str) -> bytes:
    """A graph in g2o's text, its information with so many digits."""
    lines = [f"VERTEX_SE2 {k} {x!r} {y!r} {angle!r}" for k, (x, y, angle) in enumerate(poses.tolist())]
    for edge in edges:
        a, b = edge.nodes
        z = edge.measurement
        information = upper_triangle(rotated_information(inverse(z), edge.information))
        numbers = " ".join(format(entry, digits) for entry in information.tolist())
        lines.append(f"EDGE_SE2 {a} {b} {z[0]:.6f} {z[1]:.6f} {z[2]:.6f} {numbers}")
    return "\n".join(lines).encode()


def open_along(information: Array, angle: float) -> Array:
    """The information without any in one direction of the plane."""
    slide = np.array([np.cos(angle), np.sin(angle), 0.0])
    projection = np.eye(3) - np.outer(slide, slide)
    return projection @ information @ projection


@settings(max_examples=60, deadline=None)
@given(
    st.lists(singular(3), min_size=3, max_size=3),
    singular(9),
    st.lists(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3, 3)), min_size=3, max_size=3),
    st.integers(0, 2**32 - 1),
)
def test_no_energy_is_below_0(pairwise, joint, given_poses, seed):
    """Of graphs that are written with six digits, in both forms, at any poses and at the minimum."""
    rng = np.random.default_rng(seed)
    nodes = [(0, 1), (1, 2), (2, 0)]
    graph = graph_of(
        np.array(given_poses),
        [
            Pairwise(pair, rng.normal(size=3), each, "track")
            for pair, each in zip(nodes, pairwise, strict=True)
        ],
        [NScan((0, 1, 2), rng.normal(size=(3, 3)), joint, int(rng.integers(3)), "nscan")],
    )
    text = g2o_of(graph.poses, graph.pairwise, ".6g")
    for back in (parse_graph(write_graph(graph), "graph.json"), parse_g2o(text, "graph.g2o")):
        energy = energy_of_graph(back)
        for poses in (back.poses, disturbed(back.poses, 100.0, seed)):
            terms = energy.terms(poses)
            assert (terms >= 0).all()
            assert (energy.evaluate(poses, exact=True).terms >= 0).all()
        assert optimise_graph(back, WholeGraphOptions(StopOptions(30))).energy >= 0


def energy_of_graph(graph: Graph) -> GraphEnergy:
    return GraphEnergy(len(graph), graph.relations, np.arange(len(graph)))


@pytest.mark.parametrize("digits", [".6f", ".6g"])
def test_edges_that_are_open_in_one_direction_pull_nothing_away(digits):
    """A corridor that no scan sees the end of, and rounding that makes the open direction repel.

    Every seventh edge of a ring with loops is open, where others hold its vertices, and so are three edges
    that alone hold what hangs on them.
    """
    rng = np.random.default_rng(7)
    truth = np.concatenate([ring(60), ring(60)[[5, 25, 45]] * [1.5, 1.5, 1.0]])
    edges = ring_edges(60) + [(k, (k + 7) % 60) for k in range(0, 60, 2)] + [(5, 60), (25, 61), (45, 62)]
    relations = pairwise_relations(truth, edges, rng, noise=1.0)
    for k in [*range(0, 90, 7), 90, 91, 92]:
        relation = relations[k]
        repels = False
        while not repels:
            opened = open_along(relation.information, rng.uniform(0, np.pi))
            relations[k] = Pairwise(relation.nodes, relation.measurement, opened, "loop")
            (line,) = g2o_of(truth[:0], relations[k : k + 1], digits).decode().splitlines()
            repels = np.linalg.eigvalsh(triangle(line.split()[6:]))[0] < -1e-12 * np.trace(opened)
    exact = graph_of(disturbed(truth, 0.05), relations, [])
    graph = parse_g2o(g2o_of(exact.poses, relations, digits), "graph.g2o")
    optimum, wanted = optimise_graph(graph), optimise_graph(exact)
    assert optimum.energy == pytest.approx(wanted.energy, rel=1e-3)
    assert np.abs(relative(graph.poses, exact.poses)).max() < 0.01


def triangle(entries: list[str]) -> Array:
    xx, xy, xa, yy, ya, aa = map(float, entries)
    return np.array([[xx, xy, xa], [xy, yy, ya], [xa, ya, aa]])


@pytest.mark.parametrize("opened", ["100 100 0 100 0 400", "100 100.0001 0 100 0 400", "0 0 0 0 0 400"])
def test_an_open_chain_stays_where_it_is(opened):
    """Nothing is to be gained: its edges all fit, and what one of them does not say is no reason to move."""
    truth = np.cumsum(np.tile([0.5, 0.1, 0.02], (60, 1)), axis=0)
    edges = pairwise_relations(truth, [(k, k + 1) for k in range(59)], np.random.default_rng(0))
    text = g2o_of(truth, edges, ".6g").decode().splitlines()
    first = next(k for k, line in enumerate(text) if line.startswith("EDGE_SE2 0 1 "))
    text[first] = " ".join([*text[first].split()[:6], opened])
    graph = parse_g2o("\n".join(text).encode(), "graph.g2o")
    optimum = optimise_graph(graph)
    assert 0 <= optimum.energy < 1e-3
    assert optimum.converged
    assert np.abs(relative(graph.poses, truth)).max() < 1e-3


@pytest.mark.parametrize(("seed", "digits"), [(0, ".6g"), (0, ".6f"), (1, ".6g"), (1, ".6f")])
def test_where_nothing_is_gained_poses_do_not_go_on(seed, digits):
    """A third of the steps around a ring are open in a direction, and three loops across it hold the rest.

    What rounding has left of the open directions lowers the energy along them by millionths for ever: for
    those, poses went up to 126 m away, and it was said that the relations contradict each other.
    """
    rng = np.random.default_rng(seed)
    truth, scale = ring(60), np.diag([20.0, 30.0, 100.0])
    relations = []
    for a, b in [*ring_edges(60)[:-1], (0, 30), (5, 35), (10, 40)]:
        root = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
        information = scale @ root @ root.T @ scale
        noise = np.linalg.solve(np.linalg.cholesky(information).T, rng.normal(size=3))
        if rng.random() < 0.3:
            information = open_along(information, rng.uniform(0, np.pi))
        relations.append(Pairwise((a, b), relative(truth[b], truth[a]) + noise, information, "loop"))
    start = [truth[0]]
    for relation in relations[:59]:
        start.append(compose(start[-1], relation.measurement))
    graph = parse_g2o(g2o_of(np.array(start), relations, digits), "graph.g2o")
    optimum = optimise_graph(graph)
    assert optimum.converged
    assert optimum.iterations < 50
    assert np.abs(relative(graph.poses, np.array(start))[:, :2]).max() < 5.0
    # Nine residuals can be left of three loops; and it is a minimum.
    assert optimum.energy < 20
    system = energy_of_graph(graph).evaluate(graph.poses, exact=False)
    diagonal = system.hessian[energy_of_graph(graph).pattern.starts[:-1]][:, range(3), range(3)]
    # By Newton's step of each coordinate alone, this much of χ² could be gained.
    assert (system.gradient**2 / (2 * np.maximum(diagonal, 1.0))).max() < 1e-6


def test_what_is_read_and_mended_is_written_and_read_again():
    """A matrix that rounding has made negative moves by rounding each time, and no more."""
    truth = ring(5)
    (relation,) = pairwise_relations(truth, [(0, 1)], np.random.default_rng(3))
    opened = Pairwise((0, 1), relation.measurement, open_along(relation.information, 0.7), "loop")
    graph = graph_of(truth, [opened], [])
    for _ in range(3):
        graph = parse_g2o(write_g2o(parse_graph(write_graph(graph), "graph.json")), "graph.g2o")
    np.testing.assert_allclose(
        graph.pairwise[0].information, opened.information, atol=2e-5 * np.trace(opened.information)
    )
