"""The search for loops where visits contradict each other in the finished map."""

from __future__ import annotations

from dataclasses import replace

import pytest

from nscan_cli.evaluation.reference_relations import read_relations, relation_errors
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array
from nscan_cli.slam import pipeline
from nscan_cli.slam.backend import contradicting_visits
from nscan_cli.slam.backend.contradicting_visits import mend_contradicting_visits, worst_violation
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingOptions
from nscan_cli.slam.loop_closure.free_space_violations import FreeSpaceViolation
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.state import SlamState
from tests.benchmarks.consistency import backwards
from tests.data import data_file
from tests.logs.excerpts import excerpt
from tests.slam.mapped_logs import Mapped, mapped, office_log

SOUND, WRONG = FreeSpaceViolation(0.01, 0.01, 10, 20), FreeSpaceViolation(0.4, 0.01, 10, 20)
HALF_AS_WRONG, HARDLY_BETTER = WRONG._replace(share=0.19), WRONG._replace(share=0.21)


@pytest.fixture
def office() -> SlamState:
    """The state of a finished loop, which may be changed."""
    return copied(mapped(office_log()).state)


def copied(state: SlamState) -> SlamState:
    """The same state, with lists of its own of what the search changes."""
    return replace(
        state,
        matched_pairs=list(state.matched_pairs),
        nscan_relations=list(state.nscan_relations),
        loops=list(state.loops),
        places=list(state.places),
    )


def mended(
    state: SlamState, monkeypatch: pytest.MonkeyPatch, violations: list[FreeSpaceViolation | None]
) -> list[tuple[int, int]]:
    """Mend a state whose visits contradict each other so before and after; where loops were searched.

    The search moves the route, and adds to all lists or empties them.
    """
    searched, found = [], iter(violations)

    def close(state: SlamState, first: int, last: int) -> list[int]:
        searched.append((first, last))
        state.route = state.route._replace(poses=state.route.poses + 1.0)
        state.matched_pairs.append(state.chain[0])
        for found in (state.nscan_relations, state.loops, state.places):
            found.clear()
        return [0]

    monkeypatch.setattr(contradicting_visits, "worst_violation", lambda _: next(found))
    monkeypatch.setattr(contradicting_visits, "close_loops_between", close)
    monkeypatch.setattr(contradicting_visits, "refine", lambda _: None)
    mend_contradicting_visits(state)
    return searched


@pytest.mark.parametrize("before", [None, SOUND])
def test_a_sound_map_is_left_alone(office, monkeypatch, before):
    assert mended(office, monkeypatch, [before]) == []


@pytest.mark.parametrize("after", [None, SOUND, HALF_AS_WRONG])
def test_what_ends_the_contradiction_is_kept(office, monkeypatch, after):
    poses = office.poses.copy()
    assert mended(office, monkeypatch, [WRONG, after]) == [(10, 20)]
    assert office.nscan_relations == []
    assert (office.poses == poses + 1.0).all()


def test_what_does_not_is_dropped(office, monkeypatch):
    before = copied(office)
    assert mended(office, monkeypatch, [WRONG, HARDLY_BETTER]) == [(10, 20)]
    assert office.route is before.route
    assert office.matched_pairs == before.matched_pairs
    assert office.nscan_relations == before.nscan_relations
    assert office.loops == before.loops
    assert office.places == before.places


def test_without_loops_nothing_is_searched(office, monkeypatch):
    nscan = replace(office.options.nscan, loops=False)
    state = replace(office, options=replace(office.options, nscan=nscan))
    assert mended(state, monkeypatch, [WRONG]) == []


def test_a_route_is_compared_with_earlier_visits_once(office, monkeypatch):
    calls = []

    def compare(*_: object) -> FreeSpaceViolation:
        calls.append(1)
        return SOUND

    monkeypatch.setattr(contradicting_visits, "free_space_violations", compare)
    state = replace(office, judged=None)
    assert worst_violation(state) == worst_violation(state) == SOUND
    assert len(calls) == 1
    state.route = state.route._replace(poses=state.route.poses + 1.0)
    worst_violation(state)
    assert len(calls) == 2


def clinic(reverse: bool, contradiction_sigmas: float) -> tuple[Mapped, float]:
    """fr-clinic mapped with other bounds on what contradicts odometry, and its mean error, m.

    Any match with more inliers leaves odometry.
    """
    log = read_log(str(data_file("fr-clinic.log.gz")), ReadingOptions())
    scan = ScanTrackingOptions(contradiction_sigmas=contradiction_sigmas, max_odometry_surprise=0.0)
    options = SlamOptions(tracking=TrackingOptions(scan=scan))
    found = mapped(backwards(log) if reverse else log, options, threads=2)
    return found, clinic_error(log, found.graph.poses[::-1] if reverse else found.graph.poses)


def clinic_error(log: LaserLog, poses: Array) -> float:
    """The mean error (m) of the poses (S, 3) of the scans of fr-clinic, or a part of it."""
    relations = read_relations(str(data_file("fr-clinic.relations")))
    errors = relation_errors(Trajectory(log.times, poses, log.stamps), relations, "fr-clinic")
    return float(errors.translation_spread.mean)


@pytest.mark.logs
def test_a_turn_that_tracking_has_wrong_leaves_no_loop_open(monkeypatch):
    """Tracking turns by 5° too much where bushes are. Measured: 0.107 m; 0.312 m without the search."""
    found, error = clinic(False, 2.5)
    assert error < 0.12
    assert len(found.state.places) >= 3
    monkeypatch.setattr(pipeline, "mend_contradicting_visits", lambda _: None)
    assert clinic(False, 2.5)[1] > 0.2


@pytest.mark.logs
def test_a_loop_is_found_65_m_away():
    """Measured: 0.113 m; 2.4 m where 50 m are searched."""
    assert clinic(True, 1.5)[1] < 0.13


@pytest.mark.logs
def test_two_keyframes_that_agree_close_a_loop_that_contradicts_earlier_visits():
    """Without its first 400 scans. Measured: 0.099 m; 0.143 m where places so far off need a third one."""
    whole = read_log(str(data_file("fr-clinic.log.gz")), ReadingOptions())
    log = excerpt(whole, slice(400, None))
    assert clinic_error(log, mapped(log, threads=2).graph.poses) < 0.11
