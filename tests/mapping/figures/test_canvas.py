import numpy as np
import pytest

from nscan_cli.mapping.figures import canvas as canvas_module
from nscan_cli.mapping.figures.canvas import BLUE, GREEN, PURPLE, SKY, VERMILLION, WHITE, Canvas
from tests.mapping.figures.pixels import close_to, pixels

BOUNDS = (-2.0, -1.0, 2.0, 1.0)


def test_metres_become_pixels_with_y_upwards():
    canvas = Canvas(BOUNDS, 100, margins=(50, 25, 0, 0))
    # The longer side has 400 pixels, a unit 0.4: margins of 20 and 10 pixels.
    assert canvas.size == (420, 210)
    corners = canvas.pixels(np.array([[-2.0, 1.0], [2.0, -1.0], [0.0, 0.0]]))
    assert corners.tolist() == [[20, 10], [420, 210], [220, 110]]


def test_a_blank_canvas_has_the_size_that_was_asked_for():
    assert Canvas.blank(BOUNDS, 600).size == (600, 300)


def test_the_background_is_drawn_as_it_is():
    shades = np.arange(200, dtype=np.uint8).reshape(10, 20)
    picture = pixels(Canvas(BOUNDS, 5, shades))
    assert np.array_equal(picture, np.repeat(shades[..., None], 3, axis=-1))


def test_a_line_covers_its_width_and_no_more():
    canvas = Canvas(BOUNDS, 100)
    # 10 units of 0.4 pixels.
    canvas.line(np.array([[-1.0, 0.0], [1.0, 0.0]]), BLUE, width=10)
    covered = (255 * 3 - pixels(canvas).sum(axis=-1)) / (255 * 3 - sum(BLUE))
    assert covered[:, 200].sum() == pytest.approx(4, abs=0.4)
    assert covered[100, :].sum() == pytest.approx(200, abs=2)
    assert covered[:, :95].sum() == 0


def test_a_line_of_a_robot_that_stands_still_is_drawn_all_the_same():
    canvas = Canvas(BOUNDS, 100)
    canvas.line(np.repeat([[-1.0, 0.0], [1.0, 0.0]], 50, axis=0), BLUE, width=10)
    assert close_to(pixels(canvas)[100, 200], BLUE)


@pytest.mark.parametrize("corners", [2, 31, 32, 33, 62, 63, 200])
def test_a_line_of_any_length_is_unbroken(corners):
    canvas = Canvas(BOUNDS, 300)
    x = np.linspace(-1.9, 1.9, corners)
    points = np.stack([x, 0.8 * (-1.0) ** np.arange(corners)], axis=1)
    canvas.line(points, BLUE, width=4)
    along = np.linspace(0, corners - 1, 5 * corners)
    between = np.stack([np.interp(along, np.arange(corners), points[:, k]) for k in (0, 1)], axis=1)
    columns, rows = np.floor(canvas.pixels(between[1:-1])).astype(int).T
    assert close_to(pixels(canvas)[rows, columns], BLUE).mean() > 0.95


def test_a_line_of_one_point_is_no_error():
    canvas = Canvas(BOUNDS, 100)
    canvas.line(np.array([[0.0, 0.0]]), BLUE)
    assert canvas.image().size == canvas.size


def test_segments_join_partners_only():
    canvas = Canvas(BOUNDS, 100)
    starts, ends = np.array([[-1.0, -0.5], [-1.0, 0.5]]), np.array([[1.0, -0.5], [1.0, 0.5]])
    canvas.segments(starts, ends, GREEN, width=5)
    drawn = ~close_to(pixels(canvas), WHITE)
    assert drawn[50, 110:290].all()
    assert drawn[150, 110:290].all()
    assert not drawn[70:130].any()


def test_an_ellipse_shows_the_covariance():
    canvas = Canvas(BOUNDS, 200)
    turn = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    covariance = turn @ np.diag([0.4**2, 0.1**2]) @ turn.T
    canvas.ellipses(np.array([[0.2, 0.1]]), covariance[None], 2.0, PURPLE)
    rows, columns = np.nonzero(~close_to(pixels(canvas), WHITE))
    # The half width of an ellipse of k standard deviations is k √C_xx.
    for where, variance, centre in ((columns, covariance[0, 0], 440), (rows, covariance[1, 1], 180)):
        half = 2 * np.sqrt(variance) * 200
        assert where.min() == pytest.approx(centre - half, abs=2)
        assert where.max() == pytest.approx(centre + half, abs=2)
    # It leans to the upper right: y grows upwards.
    upper = columns[rows < 150].mean()
    lower = columns[rows > 210].mean()
    assert upper > lower


def test_circles_have_their_radius_and_their_ring():
    canvas = Canvas(BOUNDS, 100)
    canvas.circles(np.array([[0.0, 0.0]]), 50, SKY, ring=BLUE)
    picture = pixels(canvas)
    assert close_to(picture[100, 190:210], SKY).all()
    drawn = np.flatnonzero(~close_to(picture[100], WHITE))
    assert drawn[-1] - drawn[0] == pytest.approx(40, abs=2)
    assert not close_to(picture[100, drawn[1]], SKY)


def test_a_cloud_is_darker_where_there_are_more_points_and_stays_below_strokes():
    canvas = Canvas(BOUNDS, 100)
    canvas.line(np.array([[-1.0, 0.5], [1.0, 0.5]]), BLUE, width=10)
    points = [[0.005, 0.005]] + [[0.505, 0.005]] * 3 + [[0.005, 0.505]] + [[5.0, 5.0]]
    canvas.cloud(np.array(points), (0, 0, 0), 0.5)
    picture = pixels(canvas)
    assert picture[99, 200].tolist() == [128] * 3
    # Half of the paper shows through every point: 255 / 2³.
    assert picture[99, 250].tolist() == [32] * 3
    assert close_to(picture[49, 200], BLUE)


def test_the_bands_do_not_show(monkeypatch):
    def picture() -> np.ndarray:
        canvas = Canvas(BOUNDS, 100, margins=(60, 60, 60, 60))
        random = np.random.default_rng(0)
        canvas.line(random.uniform(-1, 1, (30, 2)), BLUE, 7)
        canvas.circles(random.uniform(-1, 1, (30, 2)), 20, SKY, VERMILLION)
        canvas.ellipses(random.uniform(-1, 1, (5, 2)), np.tile(np.diag([0.01, 0.04]), (5, 1, 1)), 1, PURPLE)
        canvas.text((100, 100), "0.5 m", size=60)
        return pixels(canvas)

    whole = picture()
    monkeypatch.setattr(canvas_module, "BAND_ROWS", 37)
    assert np.abs(picture() - whole).max() <= 1


def test_text_stands_where_it_is_anchored_and_is_as_wide_as_said():
    canvas = Canvas(BOUNDS, 250)
    canvas.text((500, 250), "12.5 m", "mm", size=40)
    rows, columns = np.nonzero(pixels(canvas).sum(axis=-1) < 600)
    assert (columns.min() + columns.max()) / 2 == pytest.approx(500, abs=4)
    assert (rows.min() + rows.max()) / 2 == pytest.approx(250, abs=6)
    assert np.ptp(columns) == pytest.approx(canvas.text_width("12.5 m", size=40), rel=0.1)
