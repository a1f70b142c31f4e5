"""Step 4: what counts as found, and what two keyframes have to agree on."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence

import numpy as np
import pytest

from nscan_cli.graph.model import Loop, Pairwise
from nscan_cli.poses import Indices, compose, relative
from nscan_cli.slam.backend.energy_cache import EnergyCache
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.keyframes.route import route_of
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, match_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.local_matching.pairwise_relations import match_neighbours_pairwise
from nscan_cli.slam.loop_closure import loop_detector
from nscan_cli.slam.loop_closure.loop_detector import LoopDetector
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.verification import AMBIGUOUS, NO_SECOND, OUTDONE, SO_FAR_OFF, TOO_LITTLE
from tests.slam.keyframe_drives import (
    CABINETS,
    ROUND,
    ROWS,
    Driven,
    about,
    along,
    closed_along,
    like_doors_drive,
    round_drive,
    twin_drive,
)

NSCAN = NScanOptions()
SLIPS = pytest.mark.parametrize(
    "slip",
    [(2.5, 0.0, 0.0), (0.0, 2.5, 0.0), (-2.5, 1.0, 0.05), (0.0, 0.0, 0.15)],
    ids=["along", "across", "aslant and turned", "turned"],
)
SLIPPED = 34
"""The relation of round_drive() that is bent, 51 m from the start."""
ACROSS = (0.0, 2.5, 0.0)
NEVER = LoopClosureOptions(min_score=1.1, min_score_far=1.1)
"""No scan fits better than entirely."""


def closing(options: LoopClosureOptions = LoopClosureOptions()) -> LoopDetector:
    return LoopDetector(options, NSCAN, match_neighbours, EnergyCache(ROWS * len(round_drive().keyframes)))


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
        assert place.local_match.nscan is not None
        assert place.local_match.nscan.origin == "loop"
    assert closed_along(closing(NEVER), drive) == []


def test_one_keyframe_alone_closes_nothing():
    """The first of the two is searched and found, and waits; if the log ends there, it has been refused."""
    drive = bent()
    first = closed_along(closing(), drive)[0][1][0]
    alone = closing()
    assert closed_along(alone, drive, until=first.centre) == []
    assert first.local_match.loop is not None
    verdict = dataclasses.replace(first.local_match.loop, accepted=False, reason=NO_SECOND)
    assert alone.refused() == [verdict]
    assert verdict.nodes == (ROWS * first.old, ROWS * first.centre)


def test_what_is_accepted_is_not_refused_as_well():
    drive, both = bent(), closing()
    centre, places = closed_along(both, drive)[0]
    again = closing()
    closed_along(again, drive, until=centre)
    refused = {loop.nodes for loop in again.refused()}
    assert not refused & {place.local_match.loop.nodes for place in places if place.local_match.loop}


@pytest.mark.parametrize(
    "options",
    [
        LoopClosureOptions(agreement_distance=1e-4),
        LoopClosureOptions(agreement_turn=1e-6),
        LoopClosureOptions(agreement_path=1.0),
    ],
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
    rash = closed_along(closing(LoopClosureOptions(rival_score=1.01)), doors)
    places = [place for _, several in rash for place in several]
    off = [p.measured - relative(doors.truth[p.centre], doors.truth[p.old]) for p in places]
    assert max(np.abs(error[0]) for error in off) > 2.5


def test_a_twin_farther_off_than_tracking_can_be_is_not_taken_for_the_place():
    """A corridor beside the one driven first looks just the same; searched that far, it would be accepted."""
    twin = twin_drive()
    assert closed_along(closing(), twin) == []
    rash = closed_along(closing(LoopClosureOptions(min_distance=9.0)), twin)
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


def test_what_is_farther_off_than_the_path_drifts_must_be_seen_from_scans_far_apart():
    """A corridor beside the one driven first: taken for a slip of 9 m, two keyframes 3 m apart would do."""
    twin, beside = twin_drive(), LoopClosureOptions().scan_path

    def span(places: list[Place]) -> float:
        first, last = (twin.keyframes[place.centre].tracked.path for place in (places[0], places[-1]))
        return last - first

    hasty = closed_along(closing(LoopClosureOptions(min_distance=9.0, slip_distance=9.0)), twin)[0][1]
    assert len(hasty) == 2
    assert span(hasty) < 2 * beside
    late = closed_along(closing(LoopClosureOptions(min_distance=9.0)), twin)[0][1]
    assert len(late) >= 3
    assert span(late) >= 2 * beside
    waits = closing(LoopClosureOptions(min_distance=9.0))
    assert closed_along(waits, twin, until=late[-2].centre) == []
    assert {loop.reason for loop in waits.refused()} == {SO_FAR_OFF}


def carried(firsts: Sequence[int]) -> Driven:
    """A corridor, and then, carried there, once round an office and 16 m of it once more.

    The robot is carried before the keyframes of `firsts`.
    """
    doors, office, breaking = like_doors_drive(), round_drive(), BreakOptions()
    keyframes, chain = [], []
    for k, keyframe in enumerate([*doors.keyframes[:9], *office.keyframes]):
        pieces = sum(k >= first for first in firsts)
        path = keyframe.tracked.path + breaking.path * pieces
        tracked = dataclasses.replace(keyframe.tracked, path=path)
        keyframes.append(dataclasses.replace(keyframe, row=ROWS * k, tracked=tracked))
    nothing = np.diag(np.array([breaking.distance_sigma, breaking.distance_sigma, breaking.turn_sigma]) ** -2)
    step = Pairwise((0, 0), np.array([30.0, 5.0, 2.0]), nothing, "track")
    for k, relation in enumerate([*doors.chain[:8], step, *office.chain]):
        known = step if k + 1 in firsts else relation
        chain.append(dataclasses.replace(known, nodes=(ROWS * k, ROWS * (k + 1))))
    return Driven(keyframes, chain, along(chain), office.truth)


def lost(drive: Driven, options: LoopClosureOptions = LoopClosureOptions()) -> LoopDetector:
    return LoopDetector(options, NSCAN, match_neighbours, EnergyCache(ROWS * len(drive.keyframes)))


def test_who_is_lost_is_searched_for_in_all_that_was_seen_before():
    """The corridor is no less likely than the office, of which nobody knows how it lies to it."""
    drive = carried((0, 9, 54))
    found = closed_along(lost(drive), drive)
    assert found
    for _, places in found:
        assert len(places) >= 3
        for place in places:
            assert 9 <= place.old < 54 <= place.centre < len(drive.keyframes)
            off = place.measured - relative(drive.truth[place.centre - 9], drive.truth[place.old - 9])
            assert np.abs(off[:2]).max() < 0.05


@pytest.mark.parametrize(("least", "is_searched"), [(3, False), (2, True)])
def test_who_is_lost_is_not_searched_for_in_pieces_of_two_keyframes(monkeypatch, least, is_searched):
    """Each would take as long as a long one, and tells no place."""
    drive, searched = carried(range(0, 56, 2)), []
    monkeypatch.setattr(loop_detector, "find_place", lambda *_arguments: searched.append(True))
    closed_along(lost(drive, LoopClosureOptions(min_lost_visit=least)), drive, until=55)
    assert bool(searched) == is_searched


def searches(monkeypatch: pytest.MonkeyPatch, drive: Driven, most: int) -> tuple[Counter[int], set[int]]:
    """The number of searches by keyframe, and all keyframes among which one was searched, when none finds."""
    searched, among = Counter[int](), set[int]()

    def finds_nothing(_route: object, centre: int, earlier: Indices, *_arguments: object) -> None:
        searched[centre] += 1
        among.update(earlier.tolist())

    monkeypatch.setattr(loop_detector, "find_place", finds_nothing)
    closed_along(lost(drive, LoopClosureOptions(max_lost_searches=most)), drive)
    return searched, among


def test_who_is_lost_is_searched_for_in_few_of_many_pieces_at_once(monkeypatch):
    """The track breaks twelve times. Each keyframe takes a few searches, and no piece is left out."""
    drive, most = carried(range(4, 52, 4)), LoopClosureOptions().max_lost_searches
    few, among = searches(monkeypatch, drive, most)
    assert max(few.values()) == most
    every, among_every = searches(monkeypatch, drive, 100)
    assert max(every.values()) > 2 * most
    assert few.total() < 0.7 * every.total()
    assert among == among_every


# ----------------------------------------------------------------------------- where is searched


def doubted(off: tuple[float, float, float], options: LoopClosureOptions, origin: str = "loop") -> str | None:
    """What a joint match is told that puts the last but few keyframes of round_drive() off their place."""
    drive, detector, centre = round_drive(), closing(options), 49
    for k, relation in enumerate(drive.chain[:centre]):
        detector.extend(relation, drive.keyframes[k + 1].tracked.path - drive.keyframes[k].tracked.path)
    nodes = (ROWS * 3, ROWS * centre)
    measured = compose(relative(drive.truth[centre], drive.truth[3]), np.array(off))
    local_match = LocalMatch(
        (Pairwise(nodes, measured, np.eye(3), origin),), None, Loop(nodes, True, "", 0.7), 0.0, True
    )
    known = route_of(drive.keyframes, drive.chain, drive.truth[: centre + 1])
    return detector.why_doubted(known, centre, local_match, list)


def test_a_loop_from_a_poor_start_must_stand_a_search():
    """66 m of way may have slipped by 1.3 m; 0.1 mm of slip a metre is nothing, whatever the match says."""
    options = LoopClosureOptions()
    assert doubted((0.05, 0.0, 0.01), options) is None
    assert doubted((2.0, 0.0, 0.0), options) == OUTDONE
    assert doubted((0.0, 0.0, 0.4), options) == TOO_LITTLE
    assert doubted((2.0, 0.0, 0.0), options, "track") is None
    assert doubted((2.0, 0.0, 0.0), LoopClosureOptions(drift=1e-4, drift_angle=1e-5)) is None


@pytest.mark.parametrize(
    ("match", "reason"),
    [(match_neighbours, OUTDONE), (match_neighbours_pairwise, None)],
    ids=["joint", "pairs"],
)
def test_of_doors_hardly_told_apart_a_joint_match_is_compared_with_another(match, reason):
    """The way has slipped by a door, which a search sees in a tenth of the points; single matches stay."""
    doors, detector, centre = like_doors_drive(CABINETS).bent(15, (3.0, 0.0, 0.0)), closing(), 20
    for k, relation in enumerate(doors.chain[: centre + 3]):
        detector.extend(relation, doors.keyframes[k + 1].tracked.path - doors.keyframes[k].tracked.path)
    known = route_of(doors.keyframes, doors.chain, doors.poses[: centre + 4])
    local_match = about(match, known, centre, NSCAN)
    assert local_match is not None
    assert local_match.loop is not None
    assert local_match.loop.accepted
    assert detector.why_doubted(known, centre, local_match, list) == reason
