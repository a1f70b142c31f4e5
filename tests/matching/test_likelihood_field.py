"""The levels of a field: they hold the greatest values of squares, rounded up, and zero around the field."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.matching.likelihood_field import (
    GREATEST_SUM,
    LANE_BITS,
    LEVELS,
    TILE_SIDE,
    LikelihoodField,
    likelihood_field,
)
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.poses import Array
from tests.matching.problems import office_problem


@pytest.fixture(scope="module")
def field() -> LikelihoodField:
    return likelihood_field(office_problem((200, 206)).points[0], SearchOptions())


def greatest(field: LikelihoodField, side: int) -> Array:
    """(w, h) the greatest values of squares with so many cells on a side, from each cell on."""
    behind = np.pad(field.finest.astype(float), (0, side))
    squares = np.lib.stride_tricks.sliding_window_view(behind, (side, side)).max(axis=(2, 3))
    inside: Array = squares[: field.finest.shape[0], : field.finest.shape[1]]
    return inside


def test_around_a_field_is_a_border_of_zeros(field):
    for around in (
        field.finest[:TILE_SIDE],
        field.finest[:, :TILE_SIDE],
        field.finest[-1],
        field.finest[:, -1],
    ):
        assert not around.any()
    for around in (field.coarsest[0], field.coarsest[:, 0], field.coarsest[-1], field.coarsest[:, -1]):
        assert not around.any()


def test_the_coarsest_level_has_the_greatest_value_of_a_square_of_cells_rounded_up(field):
    np.testing.assert_array_equal(field.coarsest, np.ceil(greatest(field, TILE_SIDE) * field.unit))


@pytest.mark.parametrize("level", range(2, LEVELS + 1))
def test_a_square_knows_the_greatest_values_of_its_quarters(field, level):
    half = 1 << (level - 1)
    wanted = np.pad(np.ceil(greatest(field, half) * field.unit), ((0, half), (0, half)))
    width, height = field.finest.shape
    for quarter in range(4):
        x, y = (quarter & 1) * half, (quarter >> 1) * half
        held = (field.quarters[level - 2] >> (LANE_BITS * quarter)) & GREATEST_SUM
        np.testing.assert_array_equal(held, wanted[x : x + width, y : y + height])


@pytest.mark.parametrize("beams", [1, 90, 180, 1000, GREATEST_SUM, 10 * GREATEST_SUM])
def test_the_sum_of_all_beams_stays_within_its_bits(beams):
    points = np.zeros((1, 2))
    unit = likelihood_field(points, SearchOptions(beams=beams)).unit
    assert unit >= 1
    assert min(beams, GREATEST_SUM // unit) * unit <= GREATEST_SUM
