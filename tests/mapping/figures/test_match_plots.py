from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.mapping.figures import match_plots
from nscan_cli.mapping.figures.axes import LegendEntry
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, GRAY, PURPLE, VERMILLION, Canvas
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.mapping.figures.covariance_ellipses import draw_ellipses
from nscan_cli.mapping.figures.error_plots import (
    LABEL_RADIUS,
    REFERENCE_COLOUR,
    draw_number_labels,
    plot_against_reference,
    plot_relations,
)
from nscan_cli.mapping.figures.match_plots import POINT_OPACITY, plot_match, plot_nscan
from nscan_cli.mapping.figures.panels import MIN_ASPECT, bounds_around, panel, stacked_panels
from nscan_cli.matching.joint.joint_energy import all_pairs
from nscan_cli.matching.joint.joint_match import JointMatch
from nscan_cli.matching.joint.nscan_match import NScanMatch
from nscan_cli.matching.joint.outliers import OVERLAPS_NONE, ExcludedScan
from nscan_cli.matching.pairwise import NO_OVERLAP, PairMatch
from nscan_cli.matching.uncertainty import Weakest
from nscan_cli.poses import transform
from tests.mapping.figures.pixels import close_to, pixels

# Two walls of a room and a post; no scan has a point near its robot.
ROOM = np.array([[x, 4.0] for x in np.arange(-4, 4.1, 0.5)] + [[4.0, y] for y in np.arange(-4, 4, 0.5)]
                + [[-4.0, -4.0], [-2.0, -3.0]])  # fmt: skip
COVARIANCE = np.diag([0.4**2, 0.2**2, 0.01])


def near(picture: np.ndarray, colour: tuple[int, ...], most: int = 6) -> np.ndarray:
    return close_to(picture, colour, most)


def blended(colour: tuple[int, ...], below: tuple[int, ...] = (255, 255, 255)) -> tuple[int, ...]:
    """What a dot of a scan looks like, on white or over another."""
    return tuple(round(b + (c - b) * POINT_OPACITY / 255) for c, b in zip(colour, below, strict=True))


def at(canvas: Canvas, picture: np.ndarray, place: np.ndarray) -> np.ndarray:
    column, row = np.floor(canvas.pixels(place)).astype(int)
    colour: np.ndarray = picture[row, column]
    return colour


def pair_match(pose: np.ndarray, covariance: np.ndarray | None, reason: str | None = None) -> PairMatch:
    return PairMatch(
        pose=pose, energy=-1.0, gradient_norm=0.0, decrement=0.0, hessian=np.eye(3), covariance=covariance,
        eigenvalues=np.ones(3), weakest=Weakest(0.0, 0.1, True), overlap=0.9, iterations=5, evaluations=6,
        unsettled=0, reason=reason,
    )  # fmt: skip


def panels_of_match(start: np.ndarray, match: PairMatch) -> tuple[Canvas, np.ndarray, np.ndarray]:
    """A canvas of the panels' size, and the two panels."""
    moving = transform(np.array([-1.0, -0.5, 0.0]), ROOM)
    picture = pixels(plot_match((7, 9), ROOM, moving, start, match))
    places = [ROOM, transform(start, moving), transform(match.pose, moving), np.zeros((1, 2))]
    canvas = panel(bounds_around(np.concatenate(places), MIN_ASPECT), beside=True)
    width, height = canvas.size
    assert picture.shape == (height, 2 * width, 3)
    return canvas, picture[:, :width], picture[:, width:]


def test_both_scans_are_where_they_should_be_before_and_after():
    start, end = np.array([0.0, 0.0, 0.0]), np.array([1.0, 0.5, 0.0])
    canvas, before, after = panels_of_match(start, pair_match(end, COVARIANCE))
    reference, post, moved = np.array([-4.0, -4.0]), np.array([-2.0, -3.0]), np.array([-3.0, -3.5])
    assert near(at(canvas, before, reference), blended(BLUE), 12)
    for picture in (before, after):
        assert near(picture, BLUE).sum() > 100
        assert near(picture, VERMILLION).sum() > 100
    # At the start the moved scan's post is 1 m to the left of its place and half a metre below it.
    assert near(at(canvas, before, post), blended(BLUE), 12)
    assert near(at(canvas, before, moved), blended(VERMILLION), 12)
    # At the end it lies over the reference's, and where it was there is nothing.
    assert near(at(canvas, after, post), blended(VERMILLION, blended(BLUE)), 12)
    assert near(at(canvas, after, moved), (255, 255, 255))


def test_robots_are_circles_with_their_heading():
    start = np.array([0.0, 2.0, np.pi / 2])
    canvas, before, _after = panels_of_match(start, pair_match(start, None))
    unit = canvas.unit
    for pose, colour in ((np.zeros(3), BLUE), (start, VERMILLION)):
        column, row = canvas.pixels(pose[:2])
        ahead = np.array([np.cos(pose[2]), -np.sin(pose[2])]) * 1.7 * match_plots.ROBOT_RADIUS * unit
        for x, y, drawn in (
            (column, row, True),
            (column + ahead[0], row + ahead[1], True),
            (column - ahead[0], row - ahead[1], False),
        ):
            assert near(before[int(y), int(x)], colour) == drawn


def test_the_ellipse_shows_three_sigma_after_the_match_only():
    pose = np.array([1.0, 0.5, 0.0])
    canvas, before, after = panels_of_match(np.zeros(3), pair_match(pose, COVARIANCE))
    ring = near(after, PURPLE, 40)
    ring[canvas.plot[3] :] = False
    rows, columns = np.nonzero(ring)
    left, top = canvas.pixels(pose[:2] + np.array([-1.2, 0.6]))
    right, bottom = canvas.pixels(pose[:2] + np.array([1.2, -0.6]))
    assert (columns.min(), columns.max()) == (pytest.approx(left, abs=4), pytest.approx(right, abs=4))
    assert (rows.min(), rows.max()) == (pytest.approx(top, abs=4), pytest.approx(bottom, abs=4))
    assert not near(before, PURPLE, 40).any()


@pytest.mark.parametrize(
    ("sigma", "times"), [(1.0, 1), (0.09, 2), (0.05, 2), (0.02, 5), (0.01, 10), (0.0009, 200), (1e-9, 1000)]
)
def test_an_ellipse_is_enlarged_to_be_seen_and_the_legend_says_how_much(sigma, times):
    # 1000 pixels are 10 m: 30 units are 0.3 m, and 3 sigma of 0.1 m are as much.
    canvas = Canvas((0.0, 0.0, 10.0, 10.0), 100)
    covariance = np.diag([sigma**2, (sigma / 2) ** 2])[None]
    shape, colour, meaning = draw_ellipses(canvas, np.full((1, 2), 5.0), covariance, PURPLE, 30.0)
    assert (shape, colour) == ("ellipse", PURPLE)
    assert meaning == "3 sigma" + (f", enlarged {times} times" if times > 1 else "")
    width = np.ptp(np.nonzero(~near(pixels(canvas.image()), (255, 255, 255), 2))[1])
    assert width == pytest.approx(min(999, 2 * 300 * sigma * times), abs=4)


def test_a_match_that_knows_nothing_has_no_ellipse_and_says_why():
    canvas, _before, after = panels_of_match(
        np.zeros(3), pair_match(np.array([1.0, 0.5, 0.0]), None, NO_OVERLAP)
    )
    assert not near(after, PURPLE, 40).any()
    top = canvas.plot[1]
    _, _, good = panels_of_match(np.zeros(3), pair_match(np.array([1.0, 0.5, 0.0]), COVARIANCE))
    assert near(after[:top], BLACK, 60).sum() > near(good[:top], BLACK, 60).sum()


def test_wide_scans_are_stacked():
    corridor = np.array([[x, y] for x in np.arange(0, 20.1, 0.5) for y in (-1.0, 1.0)])
    match = pair_match(np.array([0.2, 0.0, 0.0]), COVARIANCE)
    width, height = plot_match((0, 1), corridor, corridor, np.zeros(3), match).size
    assert (width, height) == (2612, 2 * (height // 2))
    assert height < width


def nscan_of(kept: tuple[int, ...], poses: np.ndarray) -> NScanMatch:
    n = len(kept)
    joint = JointMatch(poses, np.zeros(3 * n), np.eye(3 * n), all_pairs(n), -1.0, 5, 6, 3, 0, True)
    return NScanMatch(kept, 0, joint, poses, -1.0, None, None, joint.pairs, np.full(n, 0.9), (), None)


def panels_of_nscan(
    start: np.ndarray, match: NScanMatch, left_out: list[ExcludedScan]
) -> tuple[Canvas, np.ndarray, np.ndarray]:
    """A canvas of the panels' size, the upper and the lower panel."""
    picture = pixels(plot_nscan(range(10, 10 + len(start)), [ROOM] * len(start), start, match, left_out))
    stages = [*start[list(match.kept)], *match.poses]
    places = [*(transform(pose, ROOM) for pose in stages)]
    canvas, _ = stacked_panels(bounds_around(np.concatenate(places), MIN_ASPECT))
    height = len(picture) // 2
    return canvas, picture[:height], picture[height:]


def test_scans_of_a_joint_match_have_a_colour_each_and_move():
    start = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    poses = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]])
    canvas, before, after = panels_of_nscan(start, nscan_of((0, 1, 2), poses), [])
    assert before.shape[:2] == canvas.size[::-1]
    post = np.array([-2.0, -3.0])
    for colour, first, last in zip(plasma(3), start, poses, strict=True):
        assert near(at(canvas, before, first[:2]), colour)
        assert near(at(canvas, after, last[:2]), colour)
        assert near(at(canvas, before, post + first[:2]), blended(colour), 12)
        assert near(at(canvas, after, post + last[:2]), blended(colour), 12)
    assert near(at(canvas, after, post + start[1, :2]), (255, 255, 255))


def test_a_scan_that_was_left_out_is_gray_and_crossed_and_before_only():
    start = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.3, -0.7, 0.2]])
    match = nscan_of((0, 2), start[[0, 2]])
    canvas, before, after = panels_of_nscan(start, match, [ExcludedScan(1, OVERLAPS_NONE, 0.0)])
    assert near(at(canvas, before, start[1, :2]), BLACK)
    assert near(at(canvas, before, start[1, :2] + [-2.0, -3.0]), blended(GRAY), 12)
    for aside in ([0.0, 0.0], [-2.0, -3.0]):
        assert near(at(canvas, after, start[1, :2] + aside), (255, 255, 255))


def test_a_scan_that_was_left_out_far_away_does_not_shrink_the_others():
    start = np.array([[0.0, 0.0, 0.0], [300.0, 0.0, 0.0], [0.3, -0.7, 0.2]])
    match = nscan_of((0, 2), start[[0, 2]])
    canvas, before, _after = panels_of_nscan(start, match, [ExcludedScan(1, OVERLAPS_NONE, 0.0)])
    assert before.shape[:2] == canvas.size[::-1]
    assert near(at(canvas, before, start[2, :2]), plasma(2)[1])
    # No cross in the plot; one in gray in the legend.
    bottom = canvas.plot[3]
    assert near(before[bottom:], GRAY).sum() > 20


@pytest.mark.parametrize(
    ("scans", "seen", "meanings"),
    [
        (3, [True], ["left out: 0"]),
        (3, [True, False, True], ["left out: 0, 2", "left out, not in view: 1"]),
        (3, [False] * 8, ["left out, not in view: 0, 1, 2, 3, 4, 5 and 2 more"]),
    ],
)
def test_scans_that_were_left_out_are_named(scans, seen, meanings):
    entries: list[LegendEntry] = match_plots.excluded_legend(
        [str(k) for k in range(len(seen))], np.array(seen)
    )
    assert [entry[2] for entry in entries] == meanings


@pytest.mark.parametrize(
    ("count", "meanings"), [(2, ["scan 0", "scan 1"]), (7, ["scans 0 to 6"])], ids=["few", "many"]
)
def test_few_scans_are_named_one_by_one(count, meanings):
    assert [entry[2] for entry in match_plots.scan_legend([str(k) for k in range(count)])] == meanings


def test_the_colours_of_a_ramp_get_lighter_step_by_step():
    light = [0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in plasma(12)]
    assert min(np.diff(light)) > 5
    # Still to be seen on white.
    assert light[-1] < 190
    assert len(plasma(1)) == 1


SQUARE = np.array([[0.0, 0, 0], [4, 0, 0], [8, 0, 0], [8, 8, 0], [0, 8, 0]])


def test_the_worst_relations_are_lines_between_their_poses():
    canvas = plot_relations(SQUARE, np.array([[3, 0], [0, 1]]), np.array([[0.3, 2.0], [0.1, 0.5]]), "title")
    picture = pixels(canvas.image())
    assert near(at(canvas, picture, np.array([2.0, 2.0])), VERMILLION)
    assert near(at(canvas, picture, np.array([1.0, 0.0])), VERMILLION)
    assert near(at(canvas, picture, np.array([6.0, 0.0])), BLUE)
    assert near(at(canvas, picture, np.array([4.0, 8.0])), BLUE)
    # Two numbers in the list, with their errors.
    listed = near(picture[:, canvas.plot[2] + 3 :], VERMILLION, 40)
    rows = np.flatnonzero(listed.any(axis=1))
    assert np.count_nonzero(np.diff(rows) > 1) == 1
    assert near(picture[:, canvas.plot[2] + 3 :], BLACK, 60).sum() > 200


def test_no_relation_asked_for_is_the_trajectory_alone():
    none = np.empty((0, 2))
    canvas = plot_relations(SQUARE, none.astype(np.int64), none, "title")
    picture = pixels(canvas.image())
    assert near(at(canvas, picture, np.array([6.0, 0.0])), BLUE)
    assert not near(picture, VERMILLION, 40).any()


def test_a_list_without_room_counts_the_rest():
    errors = np.column_stack([np.linspace(1, 0.1, 50), np.ones(50)])
    canvas = plot_relations(SQUARE, np.tile([[0, 1]], (50, 1)), errors, "title")
    picture = pixels(canvas.image())
    beside = near(picture[:, canvas.plot[2] + 3 :], BLACK, 60)
    # Twenty lines and the one that counts; below it nothing.
    assert np.flatnonzero(beside.any(axis=1)).max() < canvas.plot[1] + 21.5 * 27 * canvas.unit


def test_labels_lie_neither_over_each_other_nor_over_the_line():
    canvas = Canvas((0.0, 0.0, 10.0, 10.0), 100)
    line = np.stack([np.linspace(1, 9, 500), np.full(500, 5.0)], axis=1)
    draw_number_labels(canvas, np.tile([[5.0, 5.0]], (8, 1)), line, VERMILLION)
    ring = near(pixels(canvas.image()), VERMILLION, 90)
    rows = np.nonzero(ring)[0]
    # Every ring has a circumference of 2 π 11 pixels; rings that overlapped would hide some of it.
    assert len(rows) > 8 * 2 * np.pi * LABEL_RADIUS * 0.8
    assert np.abs(rows - 500).min() >= 2


def test_the_error_against_a_reference_is_told_by_colours():
    reference = np.stack([np.linspace(0, 8, 81), np.zeros(81), np.zeros(81)], axis=1)
    result = reference + np.array([0.0, 1.0, 0.0]) * np.linspace(0, 0.5, 81)[:, None]
    canvas = plot_against_reference(result, np.arange(81), np.linspace(0, 0.5, 81), reference, "title")
    picture = pixels(canvas.image())
    colours = plasma(16)
    assert near(at(canvas, picture, result[2, :2]), colours[0])
    assert near(at(canvas, picture, result[78, :2]), colours[-1])
    middle = at(canvas, picture, result[40, :2])
    assert near(middle, colours[7], 12) or near(middle, colours[8], 12)
    assert near(at(canvas, picture, np.array([6.05, 0.0])), REFERENCE_COLOUR)


def test_poses_without_a_match_have_no_colour_of_an_error():
    reference = np.stack([np.linspace(0, 8, 81), np.zeros(81), np.zeros(81)], axis=1)
    result = reference + np.array([0.0, 1.0, 0.0])
    canvas = plot_against_reference(result, np.arange(40), np.zeros(40), reference, "title")
    picture = pixels(canvas.image())
    # A line of a unit, 2.4 pixels.
    column, row = np.round(canvas.pixels(np.array([6.0, 1.0]))).astype(int)
    assert near(picture[row - 1 : row + 2, column], BLACK, 40).any()
    assert near(at(canvas, picture, np.array([2.0, 1.0])), plasma(16)[0])


def test_the_same_picture_every_time():
    match = pair_match(np.array([1.0, 0.5, 0.0]), COVARIANCE)
    first, second = (plot_match((0, 1), ROOM, ROOM, np.zeros(3), match) for _ in range(2))
    assert first.tobytes() == second.tobytes()
