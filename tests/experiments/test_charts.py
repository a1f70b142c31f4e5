from __future__ import annotations

import numpy as np
import pytest
from PIL.Image import Image

from nscan_cli.mapping.figures.canvas import BLUE, GREEN, VERMILLION, Colour
from tests.experiments.charts import SHAPE, heat_map, line_chart, ticks


def places_of(picture: Image, colour: Colour) -> np.ndarray:
    """(N, 2) the pixels (x, y) that have about this colour."""
    pixels = np.asarray(picture).astype(int)
    rows, columns = np.nonzero(np.abs(pixels - np.array(colour[:3])).max(axis=-1) < 8)
    return np.stack([columns, rows], axis=-1)


def test_lines_rise_to_the_right_place():
    x = np.array([0.0, 1.0, 2.0])
    picture = line_chart({"up": (x, x), "flat": (x, np.zeros(3))}, "x", "y", "Two lines")
    up, flat = places_of(picture, BLUE), places_of(picture, VERMILLION)
    plot = flat[flat[:, 1] < flat[:, 1].min() + 12]
    width = np.ptp(plot[:, 0])
    assert width > 0.8 * picture.width
    # The rising line ends above the flat one's right end, as high as its value says: 2 of an axis to 2.1,
    # where the x axis shows 2.2 for the 2 that the flat line is long.
    right = up[up[:, 0] > plot[:, 0].max() - 12]
    height = plot[:, 1].mean() - right[:, 1].min()
    assert height == pytest.approx(SHAPE * 1.1 * width / 1.05, rel=0.05)


def test_the_lowest_value_is_the_darkest_and_marks_lie_over_their_places():
    values = np.full((20, 30), 5.0)
    values[4, 21] = 1.0
    bounds = (0.0, 0.0, 3.0, 2.0)
    mark = np.array([[2.15, 0.45]])
    picture = heat_map(values, bounds, "x", "y", "One hole", {"hole": (GREEN, mark)})
    dark = np.asarray(picture.convert("L")) < 40
    ring = places_of(picture, GREEN)
    ring = ring[ring[:, 1] < 0.8 * picture.height]
    centre = (ring.min(axis=0) + ring.max(axis=0)) / 2
    left, top = (ring.min(axis=0) + 8).tolist()
    right, bottom = (ring.max(axis=0) - 8).tolist()
    rows, columns = np.nonzero(dark[top:bottom, left:right])
    assert len(rows)
    found = np.array([columns.mean() + left, rows.mean() + top])
    np.testing.assert_allclose(found, centre, atol=4)


@pytest.mark.parametrize(
    ("low", "high", "numbers"),
    [
        (0, 1, [0, 0.2, 0.4, 0.6, 0.8, 1]),
        (-1.25, 2.5, [-1, -0.5, 0, 0.5, 1, 1.5, 2, 2.5]),
        (3, 34, [5, 10, 15, 20, 25, 30]),
    ],
)
def test_ticks_are_round_numbers_within(low, high, numbers):
    assert ticks(low, high) == pytest.approx(numbers)
