"""A robot that drives to and fro along a room of 10 × 4 m, past a window and past a person."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.cleaning import Removed, cleaned_map, visit_counts
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, grid_of_counts, occupancy_grid
from tests.mapping.handmade_logs import log_of

ANGLES = np.radians(np.arange(-180, 180) + 0.5)
PERSON, POST = np.array([5.0, 1.2]), np.array([7.0, -1.2])
THERE_AND_BACK = np.concatenate([np.arange(-4, 4, 0.2), np.arange(4, -4, -0.2)])
ROUNDS = 5
"""16 m of path each: every visit of 20 m has passed the person's place."""


def ranges_at(x: float, with_person: bool) -> np.ndarray:
    """A scan from (x, 0) in a room from (−5, −2) to (8, 2), with a post, and a person if there is one."""
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(ANGLES) > 0, 8 - x, -5 - x) / np.cos(ANGLES)
        to_y = np.where(np.sin(ANGLES) > 0, 2.0, -2.0) / np.sin(ANGLES)
    ranges: np.ndarray = np.minimum(to_x, to_y)
    for place, radius in ((PERSON, 0.25 if with_person else 0.0), (POST, 0.2)):
        far, at = np.hypot(place[0] - x, place[1]), np.arctan2(place[1], place[0] - x)
        aside = np.abs(np.angle(np.exp(1j * (ANGLES - at))))
        ranges = np.where(aside < np.arctan2(radius, far), np.minimum(ranges, far), ranges)
    return ranges


@pytest.fixture(scope="module")
def drive() -> tuple[LaserLog, np.ndarray, np.ndarray]:
    """Log, rows and poses: the person is there in the first round only."""
    xs = np.tile(THERE_AND_BACK, ROUNDS)
    ranges = [ranges_at(x, k < len(THERE_AND_BACK)) for k, x in enumerate(xs)]
    log = log_of(ranges, float(ANGLES[0]), float(np.radians(1)))
    return log, np.arange(len(xs)), np.column_stack([xs, np.zeros((len(xs), 2))])


def near(grid: OccupancyGrid, mask: np.ndarray, place: np.ndarray, reach: float = 0.4) -> int:
    """Cells of a mask that lie within `reach` (m) of a place."""
    lines, columns = np.nonzero(mask)
    points = (np.column_stack([columns, lines]) + 0.5) * grid.resolution + np.array(grid.origin)
    return int((np.hypot(*(points - place).T) < reach).sum())


def crowded(drive: tuple[LaserLog, np.ndarray, np.ndarray]) -> OccupancyGrid:
    """The map, in which the person was hit often enough to be occupied."""
    grid = occupancy_grid(*drive)
    hits = grid.hits
    lines, columns = np.nonzero(hits)
    points = (np.column_stack([columns, lines]) + 0.5) * grid.resolution + np.array(grid.origin)
    of_person = np.hypot(*(points - PERSON).T) < 0.3
    hits[lines[of_person], columns[of_person]] *= 100
    return grid_of_counts(hits, grid.misses, grid.resolution, grid.origin)


def test_who_went_is_free_and_what_stayed_stays(drive):
    grid = crowded(drive)
    before = grid.states()
    assert near(grid, before == OCCUPIED, PERSON) > 5
    cleaned, removed = cleaned_map(grid, *drive)
    after = cleaned.states()
    assert near(grid, after == OCCUPIED, PERSON) == 0
    assert near(grid, (after == FREE) & (before == OCCUPIED), PERSON) > 5
    assert near(grid, removed.gone, PERSON) == removed.gone.sum()
    assert near(grid, after == OCCUPIED, POST) == near(grid, before == OCCUPIED, POST) > 3
    walls = (after == OCCUPIED).sum()
    assert walls >= (before == OCCUPIED).sum() - removed.gone.sum() - removed.specks.sum()


def test_visits_hit_or_look_through(drive):
    log, rows, poses = drive
    grid = occupancy_grid(log, rows, poses)
    visits = visit_counts(grid, log, rows, poses, 20.0, 2)
    column, line = (
        int((at - start) / grid.resolution) for at, start in zip(PERSON, grid.origin, strict=True)
    )
    around = slice(line - 2, line + 3), slice(column - 2, column + 3)
    assert visits.hit[around].max() == 1
    assert visits.through[line, column] >= 2
    total = int(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum() // 20) + 1
    assert (visits.hit + visits.through).max() <= total


BORDER = 3
INNER = slice(BORDER, -BORDER), slice(BORDER, -BORDER)


def small_map() -> OccupancyGrid:
    """Free space by a wall, an unreached part with a wall of its own, and a speck; unknown around them."""
    states = np.array(
        [
            [FREE, FREE, FREE, OCCUPIED, FREE, FREE, OCCUPIED],
            [FREE, FREE, FREE, OCCUPIED, FREE, FREE, OCCUPIED],
            [FREE, OCCUPIED, FREE, OCCUPIED, FREE, FREE, OCCUPIED],
            [FREE, FREE, FREE, OCCUPIED, FREE, FREE, OCCUPIED],
            [UNKNOWN, UNKNOWN, UNKNOWN, OCCUPIED, FREE, FREE, OCCUPIED],
        ]
    )
    states = np.pad(states, BORDER, constant_values=UNKNOWN)
    hits = np.where(states == OCCUPIED, 9, 0).astype(np.int32)
    misses = np.where(states == UNKNOWN, 0, 1).astype(np.int32)
    return grid_of_counts(hits, misses, 1.0, (-float(BORDER), -float(BORDER)))


@pytest.fixture
def small() -> tuple[OccupancyGrid, Removed]:
    log = log_of([[1.0]], 0.0, 0.1)
    return cleaned_map(small_map(), log, np.array([0]), np.array([[0.5, 0.5, 0.0]]))


def test_space_that_the_path_does_not_lead_to_is_unknown(small):
    cleaned, removed = small
    states, unconnected = cleaned.states()[INNER], removed.unconnected[INNER]
    assert (states[:, 4:] == UNKNOWN).all()
    assert (states[:, 3] == OCCUPIED).all()
    assert unconnected[:, 4:].all()
    assert unconnected[:, :4].sum() == 0
    assert (states[4, :3] == UNKNOWN).all()


def test_a_single_cell_goes_unless_two_visits_have_hit_it(small):
    cleaned, removed = small
    assert cleaned.states()[INNER][2, 1] == FREE
    assert removed.counts() == {"gone": 0, "specks": 1, "unconnected": 15}
    # To and fro over 40 m, with the cell always in view.
    poses = np.column_stack([np.tile([0.5, 0.5], 15), np.tile([0.5, 3.5], 15), np.zeros(30)])
    aside = np.array([1.5, 2.5]) - poses[:, :2]
    poses[:, 2] = np.arctan2(aside[:, 1], aside[:, 0])
    log = log_of(np.hypot(*aside.T)[:, None], 0.0, 0.1)
    kept, again = cleaned_map(small_map(), log, np.arange(30), poses)
    assert kept.states()[INNER][2, 1] == OCCUPIED
    assert again.specks.sum() == 0
