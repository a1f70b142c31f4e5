from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from nscan_cli.matching.correlative_search import FoundPose, Search, search
from nscan_cli.matching.likelihood_field import TILE_SIDE, LikelihoodField, likelihood_field
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.poses import Array, relative, transform, wrap
from tests.matching.problems import Problem, office_problem

OPTIONS = SearchOptions()


@pytest.fixture(scope="module")
def two() -> Problem:
    """Two scans of a room, a metre and a turn apart."""
    return office_problem((200, 206))


def finest(field: LikelihoodField) -> NDArray[np.float32]:
    """(w, h) the cells of the field itself."""
    return field.finest[TILE_SIDE:-1, TILE_SIDE:-1]


def score(reference: Array, points: Array, pose: Array) -> float:
    """The score by its definition, cell by cell."""
    field = likelihood_field(reference, OPTIONS)
    cells = np.floor((transform(pose, points) - [field.x, field.y]) / field.cell).astype(int)
    total = 0.0
    for ix, iy in cells.tolist():
        if 0 <= ix < finest(field).shape[0] and 0 <= iy < finest(field).shape[1]:
            centre = np.array([field.x, field.y]) + field.cell * (np.array([ix, iy]) + 0.5)
            square = ((reference - centre) ** 2).sum(axis=1).min()
            near = np.abs(np.floor((reference - [field.x, field.y]) / field.cell) - [ix, iy]).max(axis=1)
            # A point reaches two cells far.
            square = ((reference[near <= 2] - centre) ** 2).sum(axis=1).min() if (near <= 2).any() else np.inf
            total += np.exp(-0.5 * square / OPTIONS.spread**2)
    return total / len(points)


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (3.9, -2.2, 0.9), (-4.1, 4.2, -1.0)])
def test_a_pose_is_found_from_far_away(two, off):
    true = relative(two.truth[1], two.truth[0])
    field = likelihood_field(two.points[0], OPTIONS)
    found = search(field, two.points[1], true + np.array(off), 0.0, OPTIONS)
    assert found is not None
    wrong = found.pose - true
    assert np.hypot(wrong[0], wrong[1]) < 0.25
    assert abs(wrap(wrong[2])) < 0.05


def test_nothing_in_the_window_scores_more(two):
    """Against every pose of the lattice, a coarse window; and the score is the one of its definition."""
    window = SearchOptions(distance=1.0, turn=0.1, beams=40)
    field = likelihood_field(two.points[0], window)
    points = two.points[1][np.linspace(0, len(two.points[1]) - 1, 40).astype(int)]
    centre = relative(two.truth[1], two.truth[0]) + np.array([0.5, 0.4, 0.05])
    found = search(field, points, centre, 0.0, window)
    assert found is not None
    assert found.score == pytest.approx(score(two.points[0], points, found.pose), rel=1e-5)
    step = window.cell / min(np.hypot(points[:, 0], points[:, 1]).max(), window.lever)
    turns = step * np.arange(-int(window.turn / step), int(window.turn / step) + 1)
    shifts = window.cell * np.arange(-5, 6)
    best = max(
        score(two.points[0], points, centre + np.array([x, y, turn]))
        for x in shifts[::2]
        for y in shifts[::2]
        for turn in turns[::4]
    )
    assert found.score >= best - 1e-6


def test_what_scores_no_more_than_asked_is_not_found(two):
    field = likelihood_field(two.points[0], OPTIONS)
    true = relative(two.truth[1], two.truth[0])
    found = search(field, two.points[1], true, 0.0, OPTIONS)
    assert found is not None
    assert search(field, two.points[1], true, found.score, OPTIONS) is None
    again = search(field, two.points[1], true, found.score - 1e-6, OPTIONS)
    assert again is not None
    np.testing.assert_array_equal(again.pose, found.pose)
    assert search(field, two.points[1], true + np.array([500.0, 0.0, 0.0]), 0.0, OPTIONS) is None


def test_what_was_searched_once_can_be_searched_again(two):
    true = relative(two.truth[1], two.truth[0])
    field = likelihood_field(two.points[0], OPTIONS)
    about = Search(field, two.points[1], true, OPTIONS)
    best = about.best(0.0)
    assert best is not None
    assert about.best(best.score) is None
    for least in (0.0, 0.5 * best.score):
        assert_found(about.best(least), best)


AWAY = 1.5
"""m"""


def test_without_a_place_the_best_pose_lies_outside_of_it(two):
    true = relative(two.truth[1], two.truth[0])
    field = likelihood_field(two.points[0], OPTIONS)
    best = search(field, two.points[1], true, 0.0, OPTIONS)
    assert best is not None
    other = Search(field, two.points[1], true, OPTIONS).best(0.0, without=(best.pose, AWAY))
    assert other is not None
    assert np.hypot(*(other.pose - best.pose)[:2]) > AWAY
    assert other.score == pytest.approx(
        score(
            two.points[0], two.points[1][np.linspace(0, len(two.points[1]) - 1, 90).astype(int)], other.pose
        ),
        rel=1e-5,
    )
    assert other.score < best.score
    # The heading does not matter, and a place that is elsewhere leaves the best.
    turned = best.pose + np.array([0.0, 0.0, 2.0])
    assert_found(Search(field, two.points[1], true, OPTIONS).best(0.0, without=(turned, AWAY)), other)
    far = best.pose + np.array([AWAY + 0.01, 0.0, 0.0])
    assert_found(Search(field, two.points[1], true, OPTIONS).best(0.0, without=(far, AWAY)), best)
    everywhere = (best.pose, 100.0)
    assert Search(field, two.points[1], true, OPTIONS).best(0.0, without=everywhere) is None


def assert_found(found: FoundPose | None, wanted: FoundPose) -> None:
    assert found is not None
    assert found.score == wanted.score
    np.testing.assert_array_equal(found.pose, wanted.pose)


@pytest.mark.parametrize("seed", range(8))
def test_without_a_place_nothing_outside_of_it_scores_more(seed):
    """Against every pose of the lattice, on a few points: the score is the field's value, cell by cell."""
    rng = np.random.default_rng(seed)
    reference, points = rng.uniform(-1.5, 1.5, (40, 2)), rng.uniform(-1.0, 1.0, (12, 2))
    window = SearchOptions(distance=1.5, turn=0.6, spread=0.2)
    field = likelihood_field(reference, window)
    centre, place, away = rng.uniform(-0.2, 0.2, 3), rng.uniform(-0.3, 0.3, 3), float(rng.uniform(0.4, 1.0))
    step = window.cell / np.hypot(points[:, 0], points[:, 1]).max()
    turns = step * np.arange(-int(window.turn / step), int(window.turn / step) + 1)
    shifts = window.cell * np.arange(-7, 8)
    lattice = centre + np.stack(np.meshgrid(shifts, shifts, turns), axis=-1).reshape(-1, 3)
    outside = lattice[np.hypot(*(lattice - place)[:, :2].T) > away]
    cells = transform(outside[:, None], points) - [field.x, field.y]
    ix, iy = np.moveaxis(np.floor(cells / field.cell).astype(int), -1, 0)
    width, height = finest(field).shape
    on = (ix >= 0) & (iy >= 0) & (ix < width) & (iy < height)
    scores = np.where(on, finest(field)[np.where(on, ix, 0), np.where(on, iy, 0)], 0.0).mean(axis=1)
    found = Search(field, points, centre, window).best(0.0, without=(place, away))
    assert found is not None
    assert np.hypot(*(found.pose - place)[:2]) > away
    assert found.score == pytest.approx(scores.max(), rel=1e-5)
