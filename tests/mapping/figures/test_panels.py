import numpy as np
import pytest
from PIL import Image

from nscan_cli.mapping.figures.canvas import BLUE, SKY, VERMILLION
from nscan_cli.mapping.figures.panels import (
    MAX_STACKED_HEIGHT,
    PLOT_PIXELS,
    bounds_around,
    panel,
    stack_images,
    stacked_panels,
)


def test_pictures_side_by_side():
    row = stack_images([Image.new("RGB", (10, 20), BLUE), Image.new("RGB", (5, 30), SKY)], True)
    assert row.size == (15, 30)
    assert row.getpixel((9, 19)) == BLUE
    assert row.getpixel((10, 0)) == SKY
    assert row.getpixel((0, 25)) == (255, 255, 255)


def test_pictures_in_a_column():
    column = stack_images([Image.new("RGB", (10, 20), BLUE), Image.new("RGB", (5, 30), SKY)])
    assert column.size == (10, 50)
    assert column.getpixel((9, 19)) == BLUE
    assert column.getpixel((0, 20)) == SKY
    assert column.getpixel((9, 25)) == (255, 255, 255)


def test_bounds_leave_room_and_are_not_too_slim():
    points = np.array([[0.0, 3.0], [10.0, 3.5]])
    assert bounds_around(points) == pytest.approx((-0.2, 2.8, 10.2, 3.7))
    # 0.4 of 10 m is 4 m, with the points' middle in the middle, and 0.2 m to spare at either end.
    assert bounds_around(points, 0.4) == pytest.approx((-0.2, 1.05, 10.2, 5.45))


def test_bounds_of_one_place_are_no_point():
    low_x, low_y, high_x, high_y = bounds_around(np.array([[2.0, 3.0], [2.0, 3.0]]), 0.4)
    assert low_x < 2 < high_x
    assert low_y < 3 < high_y


@pytest.mark.parametrize("size", [(20.0, 8.0), (10.0, 10.0), (5.0, 10.0)])
def test_stacked_panels_have_a_moderate_height(size):
    above, below = stacked_panels((0.0, 0.0, *size))
    assert above.size == below.size
    left, top, right, bottom = above.plot
    assert max(right - left, bottom - top) <= PLOT_PIXELS
    assert bottom - top <= MAX_STACKED_HEIGHT
    assert (right - left) / (bottom - top) == pytest.approx(size[0] / size[1], rel=0.01)


def test_what_reaches_into_the_margins_is_cut_off():
    canvas = panel((0.0, 0.0, 4.0, 4.0), beside=True)
    canvas.line(np.array([[-5.0, 2.0], [9.0, 2.0]]), VERMILLION, 20)
    canvas.clear_margins()
    picture = np.asarray(canvas.image()).astype(int)
    drawn = np.flatnonzero((np.abs(picture - VERMILLION).max(axis=-1) < 10).any(axis=0))
    left, _top, right, _bottom = canvas.plot
    assert (drawn[0], drawn[-1]) == (pytest.approx(left, abs=1), pytest.approx(right - 1, abs=1))
