"""Step 4: what is searched, what counts as found, and what two keyframes have to agree on."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.model import Loop, Pairwise
from nscan_cli.matching.search import SearchOptions
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam import closing as closing_module
from nscan_cli.slam.closing import NO_SECOND, Closing
from nscan_cli.slam.keyframes import route
from nscan_cli.slam.nearby import Nearby, match_nearby
from nscan_cli.slam.options import ClosingOptions, NScanOptions, SlamOptions
from nscan_cli.slam.place import AMBIGUOUS, OUTDONE, TOO_LITTLE, Place
from tests.slam.drives import (
    ROUND,
    ROWS,
    Driven,
    closed_along,
    energy_of_way,
    like_doors_drive,
    round_drive,
    slipped_round,
    twin_drive,
)
from tests.slam.runs import mapped

NSCAN = NScanOptions()
SLIPS = pytest.mark.parametrize(
    "slip",
    [(2.5, 0.0, 0.0), (0.0, 2.5, 0.0), (-2.5, 1.0, 0.05), (0.0, 0.0, 0.15)],
    ids=["along", "across", "aslant and turned", "turned"],
)
SLIPPED = 34
"""The relation of round_drive() that is bent, 51 m from the start."""
ACROSS = (0.0, 2.5, 0.0)
NEVER = ClosingOptions(score=1.1)
"""No scan fits better than entirely."""


def closing(options: ClosingOptions = ClosingOptions()) -> Closing:  # noqa: B008
    return Closing(options, NSCAN, match_nearby)


def bent(slip: tuple[float, float, float] = ACROSS) -> Driven:
    return round_drive().bent(SLIPPED, slip)


@SLIPS
def test_a_slip_is_closed_by_two_keyframes_that_agree(slip):
    """0.15 rad, 15 m before the loop closes, are 2 m there."""
    drive = bent(slip)
    found = closed_along(closing(), drive)
    centre, places = found[0]
    assert len(places) >= 2
    assert places[-1].centre == centre
    for place in places:
        assert drive.keyframes[place.centre].tracked.path > ROUND - 5.0
        error = place.measured - relative(drive.truth[place.centre], drive.truth[place.old])
        assert np.abs(error[:2]).max() < 0.05
        assert abs(error[2]) < np.radians(0.5)
        assert place.nearby.nscan is not None
        assert place.nearby.nscan.origin == "loop"
    assert closed_along(closing(NEVER), drive) == []


def test_one_keyframe_alone_closes_nothing():
    """The first of the two is searched and found, and waits; if the log ends there, it has been refused."""
    drive = bent()
    first = closed_along(closing(), drive)[0][1][0]
    alone = closing()
    assert closed_along(alone, drive, until=first.centre) == []
    assert first.nearby.loop is not None
    verdict = dataclasses.replace(first.nearby.loop, accepted=False, reason=NO_SECOND)
    assert alone.refused() == [verdict]
    assert verdict.nodes == (ROWS * first.old, ROWS * first.centre)


def test_what_is_accepted_is_not_refused_as_well():
    drive, both = bent(), closing()
    centre, places = closed_along(both, drive)[0]
    again = closing()
    closed_along(again, drive, until=centre)
    refused = {loop.nodes for loop in again.refused()}
    assert not refused & {place.nearby.loop.nodes for place in places if place.nearby.loop}


@pytest.mark.parametrize(
    "options",
    [ClosingOptions(agree=1e-4), ClosingOptions(agree_turn=1e-6), ClosingOptions(together=1.0)],
    ids=["off", "turned", "far from each other"],
)
def test_keyframes_that_do_not_agree_close_nothing(options):
    """Bounds that no two matches keep: each place waits in vain for a second."""
    lonely = closing(options)
    assert closed_along(lonely, bent()) == []
    alone = [loop for loop in lonely.refused() if loop.reason == NO_SECOND]
    assert len(alone) >= 2
    assert not any(loop.accepted for loop in lonely.refused())


def test_a_place_that_looks_alike_is_never_accepted():
    """A corridor with equal doors, driven again after a slip of 2 m: where it is nobody can tell.

    That no other place fits as well is what saves it: without, places 3 m apart are accepted.
    """
    doors = like_doors_drive().bent(15, (2.0, 0.0, 0.0))
    cautious = closing()
    assert closed_along(cautious, doors) == []
    assert len(cautious.refused()) >= 5
    assert {(loop.accepted, loop.reason) for loop in cautious.refused()} == {(False, AMBIGUOUS)}
    rash = closed_along(closing(ClosingOptions(rival=1.01)), doors)
    places = [place for _, several in rash for place in several]
    off = [p.measured - relative(doors.truth[p.centre], doors.truth[p.old]) for p in places]
    assert max(np.abs(error[0]) for error in off) > 2.5


def test_a_twin_farther_off_than_tracking_can_be_is_not_taken_for_the_place():
    """A corridor beside the one driven first looks just the same; searched that far, it would be accepted."""
    twin = twin_drive()
    assert closed_along(closing(), twin) == []
    rash = closed_along(closing(ClosingOptions(least=9.0)), twin)
    place = rash[0][1][0]
    off = place.measured - relative(twin.truth[place.centre], twin.truth[place.old])
    assert abs(off[1]) > 5.0
    # Along the same corridor again, a slip is mended.
    same = twin_drive(0.0).bent(15, (2.0, 0.0, 0.0))
    places = [place for _, several in closed_along(closing(), same) for place in several]
    assert len(places) >= 2
    for place in places:
        off = place.measured - relative(same.truth[place.centre], same.truth[place.old])
        assert np.abs(off[:2]).max() < 0.05


# ----------------------------------------------------------------------------- where is searched


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
        return Place(old, centre, measured, 5.0, Nearby((), None, loop, 0.0, True))


@pytest.fixture
def searches(monkeypatch):
    """Closing with made-up places: a correction of the whole visit for each centre where one is found."""

    def made_up(corrections: dict[int, tuple[float, float, float]]) -> Searches:
        found = Searches(corrections)
        monkeypatch.setattr(closing_module, "find_place", found)
        return found

    return made_up


def test_where_the_graph_knows_well_nothing_is_searched(searches):
    """Its own drift over the round is some centimetres; slips of 5 cm/√m are what makes a search worth it."""
    made = searches({})
    sure = ClosingOptions(drift=1e-6, drift_angle=1e-6)
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
    options = ClosingOptions()
    closed_along(closing(options), bent())
    paths = np.array([keyframe.tracked.path for keyframe in bent().keyframes])
    assert (np.diff(paths[[centre for centre, _, _ in made]]) >= options.step).all()
    for centre, earlier, window in made:
        assert (paths[centre] - paths[earlier] > NSCAN.recent).all()
        away = np.hypot(*(bent().poses[earlier, :2] - bent().poses[centre, :2]).T)
        assert away.max() <= options.around + window.distance


def test_the_window_is_as_wide_as_the_graph_is_unsure(searches):
    made = searches({})
    options = ClosingOptions()
    windows = []
    for drift, drift_angle in ((0.05, 0.002), (0.4, 0.03), (9.0, 1.0)):
        del made[:]
        closed_along(closing(ClosingOptions(drift=drift, drift_angle=drift_angle)), round_drive())
        windows.append([(window.distance, window.turn) for _, _, window in made])
    assert set(windows[0]) == {(options.least, options.least_turn)}
    # 3 · 0.4 m · √66 are 9.7 m, and the angles give some more; 3 · 0.03 · √66 are 0.73 rad.
    assert 9.0 < max(windows[1])[0] < 16.0
    assert 0.6 < max(windows[1])[1] < 0.8
    # Where not even the direction is known it is searched among all that there is.
    assert options.farthest < max(windows[2])[0] <= options.lost
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


def doubted(off: tuple[float, float, float], options: ClosingOptions, origin: str = "loop") -> str | None:
    """What a joint match is told that puts the last but few keyframes of round_drive() off their place."""
    drive, tried, centre = round_drive(), closing(options), 49
    for k, relation in enumerate(drive.chain[:centre]):
        tried.extend(relation, drive.keyframes[k + 1].tracked.path - drive.keyframes[k].tracked.path)
    nodes = (ROWS * 3, ROWS * centre)
    measured = compose(relative(drive.truth[centre], drive.truth[3]), np.array(off))
    nearby = Nearby(
        (Pairwise(nodes, measured, np.eye(3), origin),), None, Loop(nodes, True, "", 0.7), 0.0, True
    )
    energy = energy_of_way(tried, centre + 1)
    known = route(drive.keyframes, drive.chain, drive.truth[: centre + 1])
    return tried.why_doubted(known, centre, nearby, energy)


def test_a_loop_from_a_poor_start_must_stand_a_search():
    """66 m of way may have slipped by 1.3 m; 0.1 mm of slip a metre is nothing, whatever the match says."""
    options = ClosingOptions()
    assert doubted((0.05, 0.0, 0.01), options) is None
    assert doubted((2.0, 0.0, 0.0), options) == OUTDONE
    assert doubted((0.0, 0.0, 0.4), options) == TOO_LITTLE
    assert doubted((2.0, 0.0, 0.0), options, "track") is None
    assert doubted((2.0, 0.0, 0.0), ClosingOptions(drift=1e-4, drift_angle=1e-5)) is None


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
    tried = closing()
    found = closed_along(tried, bent())
    assert [place.centre for _, places in found for place in places] == ([first, then] if agree else [])
    assert len(tried.refused()) == (0 if agree else 2)


def test_a_third_that_agrees_with_the_first_leaves_the_second_alone(searches):
    made = searches({})
    closed_along(closing(), bent())
    one, two, three = [centre for centre, _, _ in made][-3:]
    searches({one: (1.0, 2.0, 0.0), two: (-1.0, 0.0, 0.0), three: (1.1, 2.0, 0.0)})
    tried = closing()
    found = closed_along(tried, bent())
    assert [[place.centre for place in places] for _, places in found] == [[one, three]]
    assert [(loop.nodes[1], loop.accepted, loop.reason) for loop in tried.refused()] == [
        (ROWS * two, False, NO_SECOND)
    ]


def test_without_loops_nothing_is_searched(searches):
    made = searches({})
    options = SlamOptions(nscan=NScanOptions(loops=False))
    alone = mapped(slipped_round(ACROSS), options)
    assert (made, alone.slam.places, alone.graph.loops) == ([], [], [])
