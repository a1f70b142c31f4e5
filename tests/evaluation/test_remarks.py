"""What is said of a reference with something wrong, and that nothing is said of a sound one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nscan_cli.evaluation.load_trajectory import load_reference, load_trajectory
from nscan_cli.evaluation.remarks import remarks
from nscan_cli.evaluation.trajectory_errors import trajectory_errors
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array, compose
from tests.data import data_file
from tests.evaluation.paths import drive, noisy, trajectory

PLACE = [30.0, -20.0, 1.0]
TRUTH = compose(PLACE, drive())
RESULT = trajectory(noisy(drive()))
Change = Callable[[Trajectory], Trajectory]


def said(reference: Trajectory, result: Trajectory = RESULT) -> list[str]:
    return list(remarks(result, reference, trajectory_errors(result, reference)))


def scaled(factor: float) -> Trajectory:
    return trajectory(TRUTH * [factor, factor, 1.0])


def later(seconds: float, poses: Array = TRUTH) -> Trajectory:
    made = trajectory(poses)
    return replace(made, times=made.times + seconds)


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_said_of_a_sound_one(seed: int):
    path = drive(seed=seed)
    assert said(trajectory(compose(PLACE, path)), trajectory(noisy(path, seed))) == []
    level = np.column_stack([np.full(len(path), 0.66), np.tile([0.01, -0.02, 0.9997], (len(path), 1))])
    assert said(trajectory(path, spatial=level), trajectory(noisy(path, seed))) == []


@pytest.mark.parametrize("seed", range(6))
def test_nor_of_a_poor_result(seed: int):
    """Its errors are of no kind that is known."""
    path = drive(seed=seed)
    errors = np.cumsum(np.random.default_rng(seed).normal(0, [0.05, 0.05, 0.01], path.shape), axis=0)
    assert said(trajectory(path), trajectory(path + errors)) == []


@pytest.mark.parametrize(("turn", "words"), [(90, "90.0° ± 0.3° throughout: frames turned, those of the "
                                                 "reference to the left"),
                                             (-7, "7.0° ± 0.3° throughout: frames turned, those of the "
                                                 "reference to the right"),
                                             (180, "180.0° ± 0.3° throughout: frames turned")])  # fmt: skip
def test_turned_frames(turn: float, words: str):
    assert said(trajectory(TRUTH + np.array([0, 0, np.radians(turn)]))) == [f"the headings differ by {words}"]


@pytest.mark.parametrize("lag", [3.0, -3.0, 0.5, 12.3])
def test_a_clock_that_is_off(lag: float):
    (words,) = said(later(lag))
    clock = f"the clock of the reference is {'ahead of' if lag > 0 else 'behind'} that of the result"
    found = float(words.removeprefix("stamps off by ").split()[0])
    assert words == f"stamps off by {found:.2f} s fit best: {clock}"
    assert found == pytest.approx(abs(lag), abs=0.03)


def test_a_path_that_repeats_itself_tells_no_lag():
    at = np.linspace(0, 12 * np.pi, 600)
    circles = np.column_stack([3 * np.cos(at), 3 * np.sin(at), at + np.pi / 2])
    assert not any("stamps" in words for words in said(later(3.0, circles), trajectory(noisy(circles))))


@pytest.mark.parametrize(("factor", "words"), [
    (1000.0, "factor 1000: the reference seems to be in millimetres"),
    (0.01, "factor 100: the result seems to be in centimetres"),
    (1 / 0.3048, "factor 3.281: the reference seems to be in feet"),
    (1.2, "factor 1.200: the reference is larger by this factor"),
])  # fmt: skip
def test_another_unit(factor: float, words: str):
    assert said(scaled(factor)) == [words]


@pytest.mark.parametrize(("point", "words"), [
    ((0.2, -0.1), "0.20 m ahead of and 0.10 m right of"),
    ((-0.5, 0.0), "0.50 m behind"),
])  # fmt: skip
def test_a_reference_of_another_point(point: tuple[float, float], words: str):
    path = compose(PLACE, compose(drive(), [*point, 0.0]))
    (sentence,) = said(trajectory(path), trajectory(drive()))
    assert sentence == f"the reference is of another point of the robot: {words} that of the result"


def test_so_is_one_of_a_robot_that_turns_where_it_is():
    path = np.column_stack([np.zeros((300, 2)), np.linspace(0, 9, 300)])
    (sentence,) = said(trajectory(compose(path, [0.3, 0.0, 0.0])), trajectory(path))
    assert sentence.endswith("0.30 m ahead of that of the result")


def test_all_of_it_at_once_keeps_its_figures():
    path = compose(compose(PLACE, compose(drive(), [0.3, 0.0, 0.0])), [0, 0, np.pi / 2])
    clock, factor, turned, point = said(later(3.0, path * [1000, 1000, 1]), trajectory(drive()))
    assert clock.startswith("stamps off by 3.00 s")
    assert factor.startswith("factor 1000: the reference seems to be in millimetres")
    assert turned.startswith("the headings differ by 90.0° ± ")
    assert "0.30 m ahead of" in point


def test_what_a_lag_and_a_lever_arm_explain_alike_is_said_to_be_either():
    """At constant speed, 0.2 s later is 0.1 m ahead."""
    at = 0.5 * 0.1 * np.arange(600)
    heading = 0.8 * np.sin(at / 3) + 0.5 * np.sin(at / 1.7)
    steps = 0.05 * np.column_stack([np.cos(heading), np.sin(heading)])
    path = np.column_stack([np.cumsum(steps, axis=0), heading])
    sentences = said(trajectory(compose(path, [1.0, 0.0, 0.0])), trajectory(path))
    assert all("stamps off" not in words or "or else" in words for words in sentences)


def test_a_mirrored_result():
    (sentence,) = said(trajectory(TRUTH * [1, -1, -1]))
    assert sentence.startswith("the result is the mirror image of the reference: mirrored, its error is 0.0")


@pytest.mark.parametrize(("spatial", "words"), [
    (lambda at: [2 * at, 0 * at, 0 * at, 0 * at + 1], "moves out of the plane, z by 1.96 m: "),
    (lambda at: [0 * at, np.sin(0.2 * np.sin(8 * np.pi * at)), 0 * at, np.cos(0.2 * np.sin(8 * np.pi * at))],
     "moves out of the plane, roll and pitch by up to 11.5°: "),
    (lambda at: [0 * at, 0 * at, 0 * at - 1, 0 * at], "is tilted by 90.0° throughout: its frame is not that"),
])  # fmt: skip
def test_motion_out_of_the_plane(spatial: Any, words: str):
    columns = np.column_stack(spatial(np.linspace(0, 1, len(TRUTH))))
    (sentence,) = said(trajectory(TRUTH, spatial=columns))
    assert sentence.startswith(f"the reference {words}")


def test_two_runs_in_one_file():
    """Written one after the other, or in order of time."""
    first, second = trajectory(TRUTH), trajectory(compose(PLACE, drive(seed=9)))
    times, poses = np.concatenate([first.times, second.times]), np.vstack([first.poses, second.poses])
    stamps = first.stamps + second.stamps
    (sentence,) = said(Trajectory.in_order(times, poses, stamps))
    assert sentence.startswith(
        "the reference has two runs under the same stamps: time goes back 1 time in it"
    )
    merged = replace(Trajectory.in_order(times, poses, stamps), rows=None)
    (sentence,) = said(merged)
    assert sentence.startswith("the reference has two runs under the same stamps: ")
    assert "stamps twice, with poses up to" in sentence


def test_lines_out_of_order_and_written_twice_are_none():
    rng = np.random.default_rng(5)
    rows = np.concatenate([rng.permutation(40), np.arange(40, 600), np.arange(0, 600, 7)])
    made = trajectory(TRUTH)
    assert said(Trajectory.in_order(made.times[rows], TRUTH[rows], [made.stamps[row] for row in rows])) == []


@pytest.mark.logs
def test_nothing_is_said_of_real_references():
    campus = load_reference(str(data_file("fr-campus.reference.tum")))
    assert said(campus, replace(campus, poses=noisy(campus.poses))) == []
    for name in ("intel.log.gz", "fr079.log.gz", "mit-csail.log.gz"):
        log = load_trajectory(str(data_file(name)))
        assert said(log, replace(log, poses=noisy(log.poses))) == []
