"""Scans that see other things than the keyframe beside which tracking has them."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import transform
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.diagnostics.options import ViewMismatchOptions
from nscan_cli.slam.diagnostics.view_mismatch import ViewMismatch, view_mismatches
from nscan_cli.slam.frontend.break_options import ViewSimilarityOptions
from nscan_cli.slam.frontend.view_similarity import view_similarity
from tests.slam.keyframe_drives import round_scene
from tests.slam.mapped_logs import mapped, mapped_real
from tests.slam.trouble_cases import ROUND, without_odometry

SIMILARITY = ViewSimilarityOptions()
SECTORS = SIMILARITY.sectors
OPTIONS = ViewMismatchOptions()


def round_about(ranges: np.ndarray) -> np.ndarray:
    """Points (SECTORS, 2), one in each part of the view."""
    angles = (np.arange(SECTORS) + 0.5) * 2 * np.pi / SECTORS - np.pi
    return np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1)


def test_a_view_is_like_itself_and_not_like_one_that_is_farther():
    ranges = np.linspace(1.0, 9.0, SECTORS)
    view = round_about(ranges)
    assert view_similarity(view, view, SIMILARITY) == 1.0
    assert view_similarity(view, round_about(ranges + 0.15), SIMILARITY) == 1.0
    assert view_similarity(view, round_about(ranges * 2), SIMILARITY) == 0.0
    half = np.where(np.arange(SECTORS) % 2 == 0, ranges, 3 * ranges)
    assert view_similarity(view, round_about(half), SIMILARITY) == 0.5


def test_only_the_nearest_thing_counts_and_only_where_both_see_one():
    near, far = round_about(np.full(SECTORS, 2.0)), round_about(np.full(SECTORS, 7.0))
    assert view_similarity(near, np.concatenate([far, near]), SIMILARITY) == 1.0
    assert view_similarity(near[: SECTORS // 2], near, SIMILARITY) == 1.0


@pytest.mark.parametrize("count", [0, 1, SIMILARITY.min_sectors - 1])
def test_from_few_bearings_nothing_is_told(count):
    view = round_about(np.full(SECTORS, 2.0))
    assert view_similarity(view, view[:count], SIMILARITY) is None


def test_a_point_straight_behind_falls_into_a_part_of_the_view():
    """At an angle of exactly π there is no part behind the last."""
    behind = np.concatenate([round_about(np.full(SECTORS, 2.0)), [[-1.0, 0.0], [-1.0, -0.0]]])
    assert view_similarity(behind, behind, SIMILARITY) == 1.0


def test_views_from_places_apart_are_compared_from_one_of_them():
    view = round_about(np.full(SECTORS, 5.0))
    away = (0.5, 0.2, 1.0)
    assert view_similarity(view, transform(np.array(away), view), SIMILARITY) == 1.0


@pytest.mark.parametrize("seed", range(1, 9))
def test_without_odometry_it_is_told_that_someone_who_walks_along_has_held_the_robot(seed):
    """At the scans, or where a place is seen again (drive 8)."""
    made = without_odometry(ROUND["someone who walks along"](round_scene().record(seed).log()))
    said = "\n".join(notices(mapped(made.log).state))
    assert "look different on another visit" in said
    assert seed == 8 or "do not see what the keyframes beside them see" in said


def found_in(run) -> ViewMismatch | None:
    state = run.state
    tracking, breaks = state.options.tracking, state.options.breaks
    poses = np.concatenate(state.tracked)
    several = [
        view_mismatches(
            state.log, poses, state.keyframes.list, tracking.max_range, breaks.view, OPTIONS, threads
        )
        for threads in (1, 2)
    ]
    assert several[0] == several[1]
    return several[0]


def test_the_stretch_is_where_the_robot_seems_to_stand():
    """Drive 5: tracking stands from scan 39 to 61, which is 4 m of way."""
    made = without_odometry(ROUND["someone who walks along"](round_scene().record(5).log()))
    run = mapped(made.log)
    found = found_in(run)
    assert found is not None
    assert 10 <= found.first < found.last <= 85
    assert found.share < OPTIONS.min_similarity
    tracked = np.concatenate(run.state.tracked)[[found.first, found.last], :2]
    assert np.linalg.norm(tracked[1] - tracked[0]) < 2.0


def test_of_a_log_without_keyframes_nothing_is_told():
    log = round_scene().record(5).log()
    assert view_mismatches(log, np.zeros((len(log), 3)), [], 30.0, SIMILARITY, OPTIONS) is None


@pytest.mark.logs
@pytest.mark.parametrize("name", ["fr079", "mit-csail", "intel"])
def test_in_real_buildings_scans_see_what_their_keyframes_saw(name):
    assert found_in(mapped_real(name)) is None
