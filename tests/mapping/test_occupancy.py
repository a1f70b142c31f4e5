import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.errors import WrongUsageError
from nscan_cli.mapping.occupancy import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    OccupancyGrid,
    OccupancyOptions,
    grid_of_counts,
    occupancy_grid,
)
from tests.mapping.handmade_logs import half_circle, log_of

ORIGIN = np.zeros((1, 3))

MAX_LENGTH = OccupancyOptions.max_beam_length


def one_beam(x: float, y: float, end_x: float, end_y: float, resolution: float = 1.0) -> OccupancyGrid:
    dx, dy = end_x - x, end_y - y
    log = log_of([[math.hypot(dx, dy)]], 0.0, 0.1)
    return occupancy_grid(log, np.array([0]), np.array([[x, y, math.atan2(dy, dx)]]), resolution)


def cells(grid: OccupancyGrid, counts: np.ndarray) -> set[tuple[int, int]]:
    """(column, row) of the cells with a count, numbered from the world's origin."""
    left, bottom = (round(edge / grid.resolution) for edge in grid.origin)
    return {(int(column) + left, int(row) + bottom) for row, column in zip(*np.nonzero(counts), strict=True)}


def test_a_beam_along_an_axis_clears_its_cells_and_hits_the_last():
    grid = one_beam(0.5, 0.5, 3.5, 0.5)
    assert cells(grid, grid.misses) == {(0, 0), (1, 0), (2, 0)}
    assert cells(grid, grid.hits) == {(3, 0)}


def test_a_slanting_beam_follows_the_borders_that_it_crosses():
    # Slope 1/2 from (0.5, 0.5): x = 1 is crossed at y = 0.75, y = 1 at x = 1.5, x = 2 at y = 1.25.
    grid = one_beam(0.5, 0.5, 2.5, 1.5)
    assert cells(grid, grid.misses) == {(0, 0), (1, 0), (1, 1)}
    assert cells(grid, grid.hits) == {(2, 1)}


def test_a_beam_to_the_lower_left_below_zero():
    # Slope 2/7 from (−0.5, −0.5): x = −1 is crossed at y = −0.64, x = −2 at y = −0.93, y = −1 at x = −2.25.
    grid = one_beam(-0.5, -0.5, -2.6, -1.1)
    assert cells(grid, grid.misses) == {(-1, -1), (-2, -1), (-3, -1)}
    assert cells(grid, grid.hits) == {(-3, -2)}


def test_a_beam_that_ends_where_it_starts_clears_nothing():
    grid = one_beam(0.2, 0.2, 0.8, 0.3)
    assert cells(grid, grid.hits) == {(0, 0)}
    assert not grid.misses.any()


def test_the_map_has_its_cells_on_multiples_of_the_resolution_and_a_free_border():
    grid = one_beam(0.12, 0.12, 0.33, 0.12, resolution=0.1)
    assert grid.origin == pytest.approx((0.0, 0.0))
    assert grid.hits.shape == (3, 5)
    assert grid.bounds == pytest.approx((0.0, 0.0, 0.5, 0.3))


def test_rays_start_at_the_laser_not_at_the_robot():
    log = log_of([[2.0]], 0.0, 0.1, mount=(1.0, 0.0, math.pi / 2))
    grid = occupancy_grid(log, np.array([0]), np.array([[0.5, 0.5, 0.0]]), 1.0)
    assert cells(grid, grid.misses) == {(1, 0), (1, 1)}
    assert cells(grid, grid.hits) == {(1, 2)}


@pytest.mark.parametrize("nothing", [np.inf, np.nan])
def test_a_beam_without_a_return_clears_nothing(nothing):
    grid = occupancy_grid(log_of([[nothing, 2.0]], 0.0, math.pi / 2), np.array([0]), ORIGIN + 0.5, 1.0)
    seen = cells(grid, grid.hits) | cells(grid, grid.misses)
    assert not any(column > 0 for column, _row in seen if _row == 0)


def test_a_beam_beyond_the_reach_clears_up_to_it_and_hits_nothing():
    grid = occupancy_grid(
        log_of([[MAX_LENGTH + 5]], 0.0, 0.1), np.array([0]), np.array([[0.5, 0.5, 0.0]]), 1.0
    )
    assert not grid.hits.any()
    assert cells(grid, grid.misses) == {(k, 0) for k in range(int(MAX_LENGTH))}


def test_beams_are_counted_one_by_one():
    # All three beams pass through cell (0, 0); the first ends in (1, 0), the others pass it.
    log = log_of([[1.0, 3.0, 3.0]], 0.0, 0.01)
    grid = occupancy_grid(log, np.array([0]), np.array([[0.5, 0.5, 0.0]]), 1.0)
    assert grid.misses[1, 1:5].tolist() == [3, 2, 2, 0]
    assert grid.hits[1, 1:5].tolist() == [0, 1, 0, 2]


def test_states_follow_the_shares():
    hits = np.array([[0, 0, 1, 1, 2, 2, 2]], dtype=np.int32)
    misses = np.array([[0, 5, 0, 1, 0, 6, 7]], dtype=np.int32)
    states = grid_of_counts(hits, misses, 0.05, (0.0, 0.0)).states()
    # 2 of 8 is a quarter and enough; 2 of 9 is less; a single hit is never enough.
    assert states.tolist() == [[UNKNOWN, FREE, UNKNOWN, FREE, OCCUPIED, OCCUPIED, FREE]]


def test_a_thin_wall_that_is_driven_along_is_kept():
    """Many beams that touch a cell of the wall at y = 1 graze it on their way to the next ones."""
    angles = np.radians(np.arange(-90, 91))
    with np.errstate(divide="ignore"):
        wall = np.where(angles > 0.03, 1.02 / np.sin(angles), np.inf)
    steps = np.arange(0, 10, 0.1)
    poses = np.stack([steps, np.zeros_like(steps), np.zeros_like(steps)], axis=1)
    grid = occupancy_grid(half_circle(np.tile(wall, (len(steps), 1))), np.arange(len(steps)), poses)
    row = round((1.0 - grid.origin[1]) / 0.05)
    from_x, to_x = (round((x - grid.origin[0]) / 0.05) for x in (1.0, 9.0))
    assert (grid.states()[row, from_x:to_x] == OCCUPIED).mean() > 0.97
    assert (grid.states()[row - 1, from_x:to_x] == FREE).all()


def test_somebody_who_walks_through_the_room_is_not_in_the_map():
    scans = 40
    ranges = np.full((scans, 181), 5.0)
    for k in range(scans):
        ranges[k, 2 * k : 2 * k + 12] = 2.0
    grid = occupancy_grid(half_circle(ranges), np.arange(scans), np.zeros((scans, 3)))
    occupied = np.argwhere(grid.states() == OCCUPIED)
    from_laser = np.hypot(*((occupied[:, ::-1] + 0.5) * 0.05 + np.array(grid.origin)).T)
    assert len(occupied) > 150
    assert from_laser.min() > 4.9


def test_too_large_a_map_is_refused_with_a_resolution_that_will_do(monkeypatch):
    monkeypatch.setenv("NSCAN_CLI_MAX_MAP_CELLS", "10000")
    log, row = log_of([[30.0, 30.0]], 0.0, math.pi / 2), np.array([0])
    with pytest.raises(WrongUsageError, match="choose --resolution") as refusal:
        occupancy_grid(log, row, ORIGIN)
    remedy = re.search(r"--resolution ([0-9.]+)", str(refusal.value))
    assert remedy is not None
    assert occupancy_grid(log, row, ORIGIN, float(remedy[1])).hits.size <= 10_000


def test_no_scans_are_refused():
    with pytest.raises(WrongUsageError, match=r"made\.log"):
        occupancy_grid(half_circle(np.ones((1, 181))), np.array([], dtype=np.int64), np.zeros((0, 3)))


coordinate = st.floats(-20, 20)


@given(
    coordinate,
    coordinate,
    st.floats(-math.pi, math.pi),
    st.floats(0.01, 30),
    st.sampled_from([0.05, 0.1, 0.3]),
)
def test_a_ray_takes_one_step_for_every_border_between_its_ends(x, y, angle, length, resolution):
    length = float(np.float32(length))
    grid = occupancy_grid(log_of([[length]], 0.0, 0.1), np.array([0]), np.array([[x, y, angle]]), resolution)
    ((end_row, end_column),) = np.argwhere(grid.hits)
    start = np.floor((np.array([x, y]) - grid.origin) / resolution + 1e-9).astype(int)
    start_low = np.floor((np.array([x, y]) - grid.origin) / resolution - 1e-9).astype(int)
    steps = {
        abs(end_column - column) + abs(end_row - row)
        for column in {start[0], start_low[0]}
        for row in {start[1], start_low[1]}
    }
    assert int(grid.misses.sum()) in steps
    assert grid.misses.max(initial=0) <= 1
    # Every point of the ray lies in a cell that was seen, or within rounding of one.
    along = np.linspace(0, length, 200)[:, None]
    points = (np.array([x, y]) + along * [math.cos(angle), math.sin(angle)] - grid.origin) / resolution
    seen = np.pad((grid.hits + grid.misses) > 0, 1)
    nudged = [np.floor(points + np.array(nudge)).astype(int) + 1 for nudge in
              ((1e-6, 1e-6), (1e-6, -1e-6), (-1e-6, 1e-6), (-1e-6, -1e-6))]  # fmt: skip
    assert np.any([seen[at[:, 1], at[:, 0]] for at in nudged], axis=0).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 5))
def test_every_beam_within_reach_is_one_hit_and_neither_order_nor_threads_matter(seed, scans, threads):
    random = np.random.default_rng(seed)
    ranges = random.choice([0.5, 3.0, 7.0, 50.0, np.inf, np.nan], (scans, 181)) * random.uniform(0.9, 1.1)
    poses = random.uniform(-5, 5, (scans, 3))
    log, rows = half_circle(ranges), np.arange(scans)
    grid = occupancy_grid(log, rows, poses, 0.1)
    assert grid.hits.sum() == np.count_nonzero(ranges <= MAX_LENGTH)
    edges = np.concatenate([grid.hits[[0, -1]].ravel(), grid.hits[:, [0, -1]].ravel()])
    assert not edges.any()
    order = random.permutation(scans)
    again = occupancy_grid(log, rows[order], poses[order], 0.1, threads)
    assert np.array_equal(again.hits, grid.hits)
    assert np.array_equal(again.misses, grid.misses)


def test_every_end_is_hit_in_its_cell():
    random = np.random.default_rng(1)
    log = half_circle(random.uniform(0.1, 45, (5, 181)))
    poses = random.uniform(-3, 3, (5, 3))
    grid = occupancy_grid(log, np.arange(5), poses)
    for k, (x, y, heading) in enumerate(poses):
        ranges = log.ranges[k].astype(np.float64)
        angles = heading + np.radians(np.arange(-90, 91))
        ends = np.array([x, y]) + ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        columns, rows = np.floor((ends[ranges <= MAX_LENGTH] - grid.origin) / grid.resolution).astype(int).T
        assert (grid.hits[rows, columns] > 0).all()
