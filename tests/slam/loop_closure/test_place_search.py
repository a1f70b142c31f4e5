"""The place of a keyframe among those of an earlier visit: found, ambiguous, or refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.model import Loop
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.poses import Array, compose, relative, wrap
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import route_of
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, LocalMatcher, match_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.local_matching.pairwise_relations import match_neighbours_pairwise
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.place_search import find_place, why_match_doubted
from nscan_cli.slam.loop_closure.verification import AMBIGUOUS, ELSEWHERE, NO_MATCH, OUTDONE
from tests.slam.keyframe_drives import (
    CABINETS,
    ROWS,
    Driven,
    about,
    driven,
    like_doors_drive,
    path_of,
    round_drive,
    round_scene,
)

CLOSING, NSCAN = LoopClosureOptions(), NScanOptions()
WINDOW = SearchOptions(distance=4.0, turn=0.2, beams=180)
CENTRE = 49
"""A keyframe of round_drive() that is where keyframe 3 was."""
EARLIER = np.arange(16)
OFF = (3.0, 0.0, np.radians(10))
OFFSETS = pytest.mark.parametrize(
    "off",
    [OFF, (-2.0, 2.2, -np.radians(10)), (0.0, -3.0, 0.0), (1.5, 2.6, np.radians(5))],
    ids=["along and turned", "aslant and turned", "across", "aslant"],
)


def moved(drive: Driven, centre: int, off: tuple[float, float, float]) -> Array:
    """(K, 3) true poses, but those of the centre's visit are off by one motion about it."""
    poses = drive.truth.copy()
    paths = np.array([keyframe.tracked.path for keyframe in drive.keyframes])
    visit = np.abs(paths - paths[centre]) <= NSCAN.visit_path
    there = poses[centre] + np.array(off)
    poses[visit] = compose(there, relative(poses[visit], poses[centre]))
    return poses


def found(
    off: tuple[float, float, float] = OFF,
    drive: Driven | None = None,
    centre: int = CENTRE,
    match: LocalMatcher = match_neighbours,
    window: SearchOptions = WINDOW,
    closing: LoopClosureOptions = CLOSING,
) -> Place | Loop | None:
    drive = drive or round_drive()
    poses = moved(drive, centre, off)
    return find_place(
        route_of(drive.keyframes, drive.chain, poses), centre, EARLIER, window, match, closing, NSCAN
    )


def off_truth(place: Place, truth: Array) -> Array:
    off = place.measured - relative(truth[place.centre], truth[place.old])
    off[2] = wrap(off[2])
    return off


@OFFSETS
@pytest.mark.parametrize("match", [match_neighbours, match_neighbours_pairwise], ids=["joint", "pairs"])
def test_the_place_is_found_from_three_metres_away(off, match):
    """Within 5 cm, as a joint match from a good start."""
    place = found(off, match=match)
    assert isinstance(place, Place)
    assert place.centre == CENTRE
    assert place.old in EARLIER
    error = off_truth(place, round_drive().truth)
    assert np.hypot(error[0], error[1]) < 0.05
    assert abs(error[2]) < np.radians(0.5)
    local_match = place.local_match
    assert local_match.loop is not None
    assert local_match.loop.accepted
    assert local_match.loop.nodes[1] == ROWS * CENTRE
    nodes = {node // ROWS for relation in local_match.relations for node in relation.nodes}
    assert len(nodes & set(EARLIER.tolist())) >= 3
    assert len(nodes - set(EARLIER.tolist())) >= 3


@OFFSETS
def test_from_there_a_joint_match_alone_does_not_find_it(off):
    drive = round_drive()
    poses = moved(drive, CENTRE, off)
    local_match = about(match_neighbours, route_of(drive.keyframes, drive.chain, poses), CENTRE, NSCAN)
    assert local_match is not None
    assert local_match.tie(ROWS * CENTRE) is None


def test_what_is_beyond_the_window_or_scores_too_little_is_not_found():
    assert found(window=dataclasses.replace(WINDOW, distance=1.0)) is None
    assert (
        found(
            window=dataclasses.replace(WINDOW, turn=0.05),
            closing=LoopClosureOptions(min_score=0.8),
        )
        is None
    )
    assert isinstance(found(), Place)
    assert found(closing=LoopClosureOptions(min_score=1.01)) is None


def test_a_place_farther_off_needs_a_smaller_score():
    """Only such a loop corrects the path there."""
    never_near = LoopClosureOptions(min_score=1.01)
    farther = dataclasses.replace(WINDOW, distance=never_near.min_distance + 1.0)
    assert found(closing=never_near) is None
    assert isinstance(found(window=farther, closing=never_near), Place)
    assert found(window=farther, closing=LoopClosureOptions(min_score_far=1.01)) is None


@pytest.mark.parametrize("off", [(2.0, 0.0, 0.0), (0.3, 0.2, 0.05), (-1.4, -0.1, 0.0)])
def test_where_doors_are_alike_the_place_is_ambiguous(off):
    """A step of 3 m changes nothing that is seen; without a rival such a place is taken, and matches."""
    doors, centre = like_doors_drive(), 20
    refused = found(off, doors, centre)
    assert isinstance(refused, Loop)
    assert (refused.accepted, refused.reason) == (False, AMBIGUOUS)
    assert refused.nodes == (ROWS * EARLIER[0], ROWS * centre)
    assert refused.score > 0.8
    assert isinstance(found(off, doors, centre, closing=LoopClosureOptions(rival_score=1.01)), Place)


@pytest.mark.parametrize(
    "view",
    [(16.4, 3.2, 0.0), (12.0, 13.0, 0.0), (9.0, 17.2, 0.0), (32.1, 10.5, 0.0)],
    ids=["a room", "another", "the corridor to the north", "that to the east"],
)
def test_where_the_earlier_visit_saw_something_else_nothing_is_accepted(view):
    """The earlier keyframes say that they were along the corridor to the south, but saw another place."""
    scene = round_scene()
    truth = scene.truth()
    rows = np.searchsorted(path_of(truth), 1.5 * EARLIER)
    elsewhere = np.array(view) + np.outer(np.linspace(0.0, 0.5, len(rows)), [1.0, 0.0, 0.0])
    foreign = driven(scene, truth[rows], path_of(truth)[rows], elsewhere).keyframes
    drive = round_drive()
    drive = drive._replace(keyframes=foreign + drive.keyframes[len(rows) :])
    for off in (OFF, (0.0, 0.0, 0.0)):
        assert not isinstance(found(off, drive), Place)
        # Nor if it stood alone.
        assert not isinstance(found(off, drive, closing=LoopClosureOptions(rival_score=1.01)), Place)


def blind(keyframe: Keyframe) -> Keyframe:
    return dataclasses.replace(keyframe, points=np.empty((0, 2)))


def test_scans_without_points_give_nothing():
    drive = round_drive()
    early = [blind(keyframe) for keyframe in drive.keyframes[: len(EARLIER)]]
    assert found(drive=drive._replace(keyframes=early + drive.keyframes[len(EARLIER) :])) is None
    late = [blind(keyframe) for keyframe in drive.keyframes[CENTRE - 10 :]]
    assert found(drive=drive._replace(keyframes=drive.keyframes[: CENTRE - 10] + late)) is None


def matching(
    shift: tuple[float, float, float] | None,
) -> tuple[LocalMatcher, list[tuple[Array, NScanOptions]]]:
    """match_neighbours whose relation has the other visit shifted, or is none; and what it was given."""
    calls = []

    def match(visited, centre, near, options) -> LocalMatch | None:
        calls.append((visited.poses, options))
        local_match = match_neighbours(visited, centre, near, options)
        if shift is None or local_match is None or local_match.nscan is None:
            return None
        local = local_match.nscan.poses.copy()
        early = np.array(local_match.nscan.nodes) < ROWS * len(EARLIER)
        local[early] = compose(np.array(shift), local[early])
        return dataclasses.replace(local_match, nscan=dataclasses.replace(local_match.nscan, poses=local))

    return match, calls


def test_a_place_that_no_match_confirms_is_refused():
    refused = found(match=matching(None)[0])
    assert isinstance(refused, Loop)
    assert (refused.nodes, refused.accepted) == ((0, ROWS * CENTRE), False)
    assert refused.reason == NO_MATCH
    assert CLOSING.min_score < refused.score <= 1.0
    assert isinstance(found(match=matching((0.0, 0.0, 0.0))[0]), Place)


def test_what_single_scans_do_not_confirm_stretches_of_both_visits_may():
    match, calls = matching((0.0, 0.0, 0.0))

    def match_stretches(visited, centre, near, options) -> LocalMatch | None:
        found = match(visited, centre, near, options)
        return found if options.min_overlap < NSCAN.min_overlap else None

    place = found(match=match_stretches)
    assert isinstance(place, Place)
    single, stretches = (options for _, options in calls)
    assert place.options == stretches
    assert stretches.radius == single.radius + CLOSING.stretch_radius
    assert stretches.max_scans == CLOSING.stretch_scans
    joint = place.local_match.nscan
    assert joint is not None
    assert len(joint.nodes) > NSCAN.max_scans


@pytest.mark.parametrize(("far", "reason"), [(0.6, None), (1.4, ELSEWHERE)])
def test_a_match_that_leads_away_is_refused(far, reason):
    """By more than a metre, as a joint match from a good start never does."""
    result = found(match=matching((far, 0.0, 0.0))[0])
    assert (result.reason if isinstance(result, Loop) else None) == reason


def test_both_visits_are_matched_from_the_place_found():
    """This visit has moved there as a whole, all others stay; the radius reaches the earlier visit."""
    match, calls = matching((0.0, 0.0, 0.0))
    place = found(match=match)
    assert isinstance(place, Place)
    assert len(calls) == 1
    poses, options = calls[0]
    truth, before = round_drive().truth, moved(round_drive(), CENTRE, OFF)
    paths = np.array([keyframe.tracked.path for keyframe in round_drive().keyframes])
    visit = np.abs(paths - paths[CENTRE]) <= NSCAN.visit_path
    np.testing.assert_array_equal(poses[~visit], before[~visit])
    near = np.abs(paths - paths[CENTRE]) <= 5.0
    assert np.hypot(*(poses[near, :2] - truth[near, :2]).T).max() < 0.3
    np.testing.assert_allclose(
        relative(poses[visit], poses[CENTRE]), relative(before[visit], before[CENTRE]), atol=1e-9
    )
    away = np.hypot(*(poses[EARLIER, :2] - poses[CENTRE, :2]).T).min()
    assert options == place.options == dataclasses.replace(NSCAN, radius=options.radius)
    assert options.radius == pytest.approx(away + NSCAN.radius)


def test_corrected_moves_the_visit_rigidly_to_its_place():
    """Golden: the centre, 90° to the left of (1, 2, 0), is 1 m ahead; keyframe 2 is 3 m ahead of that."""
    poses = np.array([[1.0, 2, 0], [7, 7, 0], [10, 7, 0]])
    place = Place(0, 1, np.array([1.0, 0, np.pi / 2]), NSCAN, LocalMatch((), None, None, 0.0, True))
    np.testing.assert_allclose(place.corrected(poses, 1), [2, 2, np.pi / 2], atol=1e-12)
    np.testing.assert_allclose(place.corrected(poses, 2), [2, 5, np.pi / 2], atol=1e-12)


def doubted(off: float, nscan: NScanOptions | None, centre: int = 20) -> str | None:
    """What is said of a keyframe that a match has so far (m) off along the corridor."""
    doors = like_doors_drive(CABINETS)
    poses = moved(doors, centre, (off, 0.0, 0.0))
    known = route_of(doors.keyframes, doors.chain, poses)
    return why_match_doubted(known, centre, poses[centre], EARLIER, WINDOW, CLOSING, nscan)


@pytest.mark.parametrize("centre", [20, 22, 24])
def test_where_another_place_fits_about_as_well_a_joint_match_decides(centre):
    """One door off, 91 to 95 % of the score remain: no search is sure of that."""
    assert doubted(3.0, NSCAN, centre) == OUTDONE
    assert doubted(0.0, NSCAN, centre) is None
    for off in (0.0, 3.0):
        assert doubted(off, None, centre) is None
