import numpy as np
import pytest

from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.mapping.figures import map_plots
from nscan_cli.mapping.figures.axes import round_length
from nscan_cli.mapping.figures.canvas import BLUE, GRAY, GREEN, PURPLE, SKY, VERMILLION, Canvas
from nscan_cli.mapping.figures.graph_edges import edges_by_kind
from nscan_cli.mapping.figures.map_plots import Overlays, plot_over_map, plot_paper_figure
from nscan_cli.mapping.occupancy import OccupancyGrid, grid_of_counts, occupancy_grid
from tests.mapping.handmade_logs import half_circle

PATH = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])


def graph_of_a_square() -> Graph:
    """Four keyframes; pairs along three sides, a loop along the fourth, an nScan relation across."""
    graph = Graph(np.arange(4), list("0123"), PATH, None, np.arange(4))
    for a, b, origin in ((0, 1, "track"), (1, 2, "track"), (2, 3, "track"), (3, 0, "loop")):
        graph.pairwise.append(Pairwise((a, b), np.zeros(3), np.eye(3), origin))
    graph.nscan.append(NScan((0, 1, 2), np.zeros((3, 3)), np.eye(9), 2, "nscan"))
    graph.marginals = {2: np.diag([0.3**2, 0.1**2, 0.01])}
    return graph


def empty_map() -> OccupancyGrid:
    counts = np.zeros((120, 120), dtype=np.int32)
    return grid_of_counts(counts, counts + 1, 0.05, (-1.0, -1.0))


def colour_at(canvas: Canvas, x: float, y: float) -> np.ndarray:
    column, row = np.floor(canvas.pixels(np.array([x, y]))).astype(int)
    colour: np.ndarray = np.asarray(canvas.image()).astype(int)[row, column]
    return colour


@pytest.mark.parametrize(
    ("place", "colour"),
    [((2.0, 0.0), GRAY), ((0.0, 2.0), VERMILLION), ((2.0, 2.0), GREEN)],
    ids=["pairwise", "loop", "nScan"],
)
def test_each_kind_of_relation_has_its_colour(place, colour):
    canvas = plot_over_map(empty_map(), graph_of_a_square(), Overlays(graph=True))
    assert np.abs(colour_at(canvas, *place) - colour).max() < 60


def test_the_path_is_drawn_alone_and_beneath_the_relations():
    graph = graph_of_a_square()
    alone = plot_over_map(empty_map(), graph, Overlays(trajectory=True))
    assert np.abs(colour_at(alone, 2.0, 0.0) - BLUE).max() < 60
    assert (colour_at(alone, 0.0, 2.0) == 255).all()
    both = np.asarray(plot_over_map(empty_map(), graph, Overlays(trajectory=True, graph=True)).image())
    assert (np.abs(both.astype(int) - SKY).max(axis=-1) < 5).any()


def test_an_uncertainty_too_small_to_be_seen_is_enlarged_and_the_legend_says_so():
    def purple(scale: float) -> tuple[int, int]:
        graph = graph_of_a_square()
        graph.marginals = {2: np.diag([0.3**2, 0.1**2, 0.01]) * scale**2}
        canvas = plot_over_map(empty_map(), graph, Overlays(uncertainty=True))
        picture = np.asarray(canvas.image()).astype(int)
        bottom = canvas.plot[3]
        near = np.abs(picture - PURPLE).max(axis=-1) < 60
        black = picture[bottom:].sum(axis=-1) < 200
        return int(near[:bottom].sum()), int(np.count_nonzero(black))

    as_it_is, legend = purple(1.0)
    enlarged, longer_legend = purple(0.01)
    assert as_it_is > 200
    # A hundredth of the size needs no more than ten times to be seen; still smaller than the other.
    assert 20 < enlarged < as_it_is
    assert longer_legend > legend


def test_walls_of_a_large_map_stay_when_cells_are_merged(monkeypatch):
    monkeypatch.setattr(map_plots, "MIN_PIXELS", 10)
    monkeypatch.setattr(map_plots, "MAX_PIXELS", 60)
    hits = np.zeros((121, 100), dtype=np.int32)
    hits[:, 50] = 9
    grid = grid_of_counts(hits, np.ones_like(hits), 0.05, (0.0, 0.0))
    canvas = plot_over_map(grid, graph_of_a_square(), Overlays(uncertainty=False))
    # Three cells along a pixel: 41 rows for 121 cells, the column of cell 50 is the seventeenth.
    left, top, right, bottom = canvas.plot
    assert (right - left, bottom - top) == (34, 41)
    picture = np.asarray(canvas.image())[top:bottom, :, 0]
    assert (picture[:, 16] == map_plots.SOFT_GRAYS[100]).all()
    # The uppermost row of pixels reaches beyond the map.
    assert (picture[1:, 10] == 255).all()
    assert 226 < picture[0, 10] < 255
    assert canvas.pixels_per_metre == pytest.approx(1 / 0.15)


def test_a_figure_shows_walls_and_path_and_leaves_out_who_walked_by():
    scans = 30
    ranges = np.full((scans, 181), 5.0)
    ranges[12, 90:96] = 2.0
    log, rows, poses = half_circle(ranges), np.arange(scans), np.zeros((scans, 3))
    poses[:, 0] = np.linspace(0, 0.001, scans)
    graph = Graph(rows, [str(k) for k in rows], poses, None, rows)
    grid = occupancy_grid(log, rows, poses)
    canvas = plot_paper_figure(log, rows, poses, grid, graph, Overlays())
    left, top, right, bottom = canvas.plot
    picture = np.asarray(canvas.image()).astype(int)
    walls = np.argwhere(picture.sum(axis=-1) < 150)
    inside = walls[(walls[:, 0] > top + 60) & (walls[:, 0] < bottom - 60) & (walls[:, 1] > left + 60)
                   & (walls[:, 1] < right - 60)]  # fmt: skip
    laser = canvas.pixels(np.zeros(2))
    distance = np.hypot(inside[:, 1] - laser[0], inside[:, 0] - laser[1]) / canvas.pixels_per_metre
    assert len(inside) > 100
    assert np.abs(distance - 5.0).max() < 0.1


def figure(overlays: Overlays, ranges: np.ndarray | None = None) -> Canvas:
    """Of a laser at the origin in the middle of a half circle, with the graph of a square."""
    scans = 20
    log = half_circle(np.full((scans, 181), 5.0) if ranges is None else ranges)
    rows, poses = np.arange(scans), np.zeros((scans, 3))
    return plot_paper_figure(
        log, rows, poses, occupancy_grid(log, rows, poses), graph_of_a_square(), overlays
    )


def colours_below(canvas: Canvas) -> set[tuple[int, ...]]:
    """Those of the legend."""
    below = np.asarray(canvas.image())[canvas.plot[3] + 1 :].reshape(-1, 3)
    return set(map(tuple, np.unique(below, axis=0).tolist()))


def test_a_figure_says_what_its_colours_mean_where_it_has_several():
    assert BLUE not in colours_below(figure(Overlays(trajectory=True)))
    assert {SKY, GREEN, GRAY, VERMILLION} <= colours_below(figure(Overlays(trajectory=True, graph=True)))
    assert PURPLE in colours_below(figure(Overlays(uncertainty=True)))


def test_a_few_points_far_out_do_not_make_a_figure_larger():
    ranges = np.full((20, 181), 5.0)
    plain = figure(Overlays(), ranges)
    ranges[:, 90] = 40.0
    ranges[1:, 90] = np.inf
    seldom = figure(Overlays(), ranges)
    assert seldom.bounds == pytest.approx(plain.bounds, abs=0.2)
    ranges[:, 80:100] = 40.0
    assert figure(Overlays(), ranges).bounds[2] > 39


def test_of_a_relation_that_closes_a_loop_the_lines_to_another_visit_are_the_loop():
    graph = graph_of_a_square()
    graph.pairwise, graph.nscan = [], [NScan((0, 1, 2, 3), np.zeros((4, 3)), np.eye(12), 0, "loop")]
    graph.poses = PATH * (5.0, 5.0, 1.0)
    edges = edges_by_kind(graph)
    # 20, 40 and 60 m of path away.
    assert edges["loop"].tolist() == [[0, 2], [0, 3]]
    assert edges["nScan"].tolist() == [[0, 1]]
    graph.poses = PATH
    assert edges_by_kind(graph)["loop"].tolist() == [[0, 1], [0, 2], [0, 3]]


@pytest.mark.parametrize(
    ("length", "rounded"),
    [(1.0, 1.0), (1.99, 1.0), (2.0, 2.0), (4.9, 2.0), (5.0, 5.0), (9.99, 5.0), (37.0, 20.0), (0.3, 0.2)],
)
def test_lengths_of_scales_are_round(length, rounded):
    assert round_length(length) == pytest.approx(rounded)
