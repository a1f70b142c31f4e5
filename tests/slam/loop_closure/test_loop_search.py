"""Step 4: where is searched, among which keyframes, how far, and which of the places found agree."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.model import Loop, Pairwise
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure import loop_detector
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.verification import NO_SECOND
from nscan_cli.slam.options import SlamOptions
from tests.slam.keyframe_drives import ROWS, Driven, closed_along, round_drive, slipped_round
from tests.slam.loop_closure.test_loop_detector import ACROSS, NSCAN, bent, closing
from tests.slam.mapped_logs import mapped


class Searches(list[tuple[int, Array, SearchOptions]]):
    """The centre, the earlier keyframes and the window of all searches; their results are made up."""

    def __init__(self, corrections: dict[int, tuple[float, float, float]]) -> None:
        super().__init__()
        self.corrections = corrections

    def __call__(self, visited, centre, earlier, window, *rest) -> Place | None:
        keyframes, poses = visited.keyframes, visited.poses
        self.append((centre, earlier, window))
        if centre not in self.corrections:
            return None
        old = int(earlier[0])
        measured = relative(compose(np.array(self.corrections[centre]), poses[centre]), poses[old])
        loop = Loop((keyframes[old].row, keyframes[centre].row), True, "", 0.9)
        return Place(old, centre, measured, NScanOptions(), LocalMatch((), None, loop, 0.0, True))


@pytest.fixture
def searches(monkeypatch):
    """Closing with made-up places: a correction of the whole visit for each centre where one is found."""

    def made_up(corrections: dict[int, tuple[float, float, float]]) -> Searches:
        found = Searches(corrections)
        monkeypatch.setattr(loop_detector, "find_place", found)
        return found

    return made_up


def test_where_the_graph_knows_well_nothing_is_searched(searches):
    """Its own drift over the round is some centimetres; slips of 5 cm/√m are what makes a search worth it."""
    made = searches({})
    sure = LoopClosureOptions(drift=1e-6, drift_angle=1e-6)
    closed_along(closing(sure), round_drive())
    assert made == []
    closed_along(closing(), round_drive())
    assert len(made) > 3
    # The graph's word does not count when a joint match has left out the scans of another visit.
    del made[:]
    closed_along(closing(sure), round_drive(), left_out=[2, 3])
    assert len(made) > 3


def test_searches_are_a_few_metres_apart_and_among_older_keyframes_only(searches):
    made = searches({})
    options = LoopClosureOptions()
    closed_along(closing(options), bent())
    paths = np.array([keyframe.tracked.path for keyframe in bent().keyframes])
    assert (np.diff(paths[[centre for centre, _, _ in made]]) >= options.search_interval).all()
    for centre, earlier, window in made:
        assert (paths[centre] - paths[earlier] > NSCAN.visit_path).all()
        away = np.hypot(*(bent().poses[earlier, :2] - bent().poses[centre, :2]).T)
        assert away.max() <= options.earlier_radius + window.distance


def test_the_window_is_as_wide_as_the_graph_is_unsure(searches):
    made = searches({})
    options = LoopClosureOptions()
    windows = []
    for drift, drift_angle in ((0.05, 0.002), (0.4, 0.03), (9.0, 1.0)):
        del made[:]
        unsure = LoopClosureOptions(drift=drift, drift_angle=drift_angle, min_lost_visit=1)
        closed_along(closing(unsure), round_drive())
        windows.append([(window.distance, window.turn) for _, _, window in made])
    assert set(windows[0]) == {(options.min_distance, options.min_turn)}
    # 3 · 0.4 m · √66 are 9.7 m, and the angles give some more; 3 · 0.03 · √66 are 0.73 rad.
    assert 9.0 < max(windows[1])[0] < 16.0
    assert 0.6 < max(windows[1])[1] < 0.8
    # Where not even the direction is known it is searched among all that there is.
    assert 0.5 * options.max_distance <= max(windows[2])[0] <= options.max_distance
    assert max(windows[2])[1] == np.pi


def three_visits(second: float, third: float) -> Driven:
    """9 m driven three times: the second visit and the third begin after so much way (m)."""
    x = np.tile(np.arange(0.0, 10.0, 1.5), 3)
    paths = x + np.repeat([0.0, second, third], len(x) // 3)
    poses = np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1)
    keyframes = [
        dataclasses.replace(
            round_drive().keyframes[0],
            row=ROWS * k,
            tracked=dataclasses.replace(round_drive().keyframes[0].tracked, path=float(paths[k])),
        )
        for k in range(len(x))
    ]
    chain = [
        Pairwise((ROWS * k, ROWS * (k + 1)), relative(poses[k + 1], poses[k]), 1e6 * np.eye(3), "track")
        for k in range(len(x) - 1)
    ]
    return Driven(keyframes, chain, poses, poses)


@pytest.mark.parametrize(
    ("second", "third", "among"),
    [(1000.0, 1100.0, 1), (100.0, 1100.0, 1), (25.0, 1100.0, 2)],
    ids=["the first is known least", "none is known in the other", "both are known as one piece"],
)
def test_what_is_searched_is_in_one_piece(searches, second, third, among):
    """Slips are 0.5 m (σ) after 100 m, so that two visits may be 1.5 m off; 0.2 m after 16 m."""
    made, visits = searches({}), three_visits(second, third)
    size = len(visits.keyframes) // 3
    closed_along(closing(), visits)
    last = [earlier for centre, earlier, _ in made if centre >= 2 * size]
    assert len(last) >= 2
    for earlier in last:
        assert earlier.tolist() == list(range(among * size))


@pytest.mark.parametrize(
    ("second", "agree"),
    [((1.0, 2.0, 0.0), True), ((1.4, 2.0, 0.0), True), ((1.6, 2.0, 0.0), False), ((1.0, 2.0, 0.06), False)],
    ids=["same", "near", "off", "turned"],
)
def test_two_places_agree_within_half_a_metre(searches, second, agree):
    """Corrections of the visit, about the world's origin, by (1, 2) m and by about as much."""
    made = searches({})
    closed_along(closing(), bent())
    first, then = [centre for centre, _, _ in made][-2:]
    here = bent().poses[then, :2]
    turn = np.array([[np.cos(second[2]), -np.sin(second[2])], [np.sin(second[2]), np.cos(second[2])]])
    # Turned about the keyframe itself, so that its place is `second` off.
    about = (*(np.array(second[:2]) + here - turn @ here), second[2])
    searches({first: (1.0, 2.0, 0.0), then: about})
    detector = closing()
    found = closed_along(detector, bent())
    assert [place.centre for _, places in found for place in places] == ([first, then] if agree else [])
    assert len(detector.refused()) == (0 if agree else 2)


def test_a_third_that_agrees_with_the_first_leaves_the_second_alone(searches):
    made = searches({})
    closed_along(closing(), bent())
    one, two, three = [centre for centre, _, _ in made][-3:]
    searches({one: (1.0, 2.0, 0.0), two: (-1.0, 0.0, 0.0), three: (1.1, 2.0, 0.0)})
    detector = closing()
    found = closed_along(detector, bent())
    assert [[place.centre for place in places] for _, places in found] == [[one, three]]
    assert [(loop.nodes[1], loop.accepted, loop.reason) for loop in detector.refused()] == [
        (ROWS * two, False, NO_SECOND)
    ]


def test_without_loops_nothing_is_searched(searches):
    made = searches({})
    options = SlamOptions(nscan=NScanOptions(loops=False))
    alone = mapped(slipped_round(ACROSS), options)
    assert (made, alone.state.places, alone.graph.loops) == ([], [], [])
