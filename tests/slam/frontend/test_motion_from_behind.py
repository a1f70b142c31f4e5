"""Scans without odometry that are tracked from behind, since the robot seemed to stand."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import log_from
from nscan_cli.logs.log_excerpt import excerpt
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, relative, wrap
from nscan_cli.slam.consistency.repeated_maps import mirrored
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.benchmarks.laser_kinds import HARD, KINDS, NONE, recorded, turning
from tests.benchmarks.lasers import rms
from tests.simulation.drive import Drive, Odometry
from tests.simulation.drive import poses as driven
from tests.simulation.faults import taken
from tests.simulation.laser import Laser
from tests.simulation.places import bare_corridors, drive_through
from tests.simulation.scenes import corridor_and_room, tee
from tests.slam.mapped_logs import mapped

HALT = 60
"""Scans"""
SCANS_IN_CORRIDOR = 40


def drive_with_halt(at: int, seed: int, every: int) -> tuple[LaserLog, Array]:
    """Down a corridor towards the far wall of a room, with a halt at a scan; the log, and its true poses."""
    truth = corridor_and_room().truth()
    truth = np.concatenate([truth[:at], np.repeat(truth[at : at + 1], HALT, axis=0), truth[at:]])
    recording = corridor_and_room().record_at(truth, seed)
    log = log_from(recording.carmen(), "halt.log", ReadingOptions(every=every, odometry=False))
    return dataclasses.replace(log, truth=None), truth[::every][: len(log)]


def way(poses: Array, scans: int) -> float:
    """Distance (m) from the first pose."""
    return float(np.hypot(*(poses[scans] - poses[0])[:2]))


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize(("at", "seed"), [(1, 2), (1, 3), (15, 3), (30, 1), (45, 1), (45, 2)])
def test_a_robot_that_drives_towards_a_far_wall_does_not_seem_to_stand(at, seed, every):
    """Up to 7 m were lost before, mostly without a word."""
    log, truth = drive_with_halt(at, seed, every)
    scans = (at + HALT + SCANS_IN_CORRIDOR) // every
    assert way(mapped(log).graph.poses, scans) == pytest.approx(way(truth, scans), abs=0.02)


@pytest.mark.parametrize("seed", [2, 3, 6])
def test_so_in_the_mirror_image(seed):
    log, truth = drive_with_halt(0, seed, 1)
    scans = HALT + SCANS_IN_CORRIDOR
    assert way(mapped(mirrored(log)).graph.poses, scans) == pytest.approx(way(truth, scans), abs=0.02)


def test_the_sample_is_mapped_without_odometry_as_with_it():
    """Four metres of its corridor were missing."""
    rows = slice(0, 60)
    alone, guided = (
        mapped(log_from(corridor_and_room().record(3).carmen(), "sample.log", ReadingOptions(odometry=given)))
        for given in (False, True)
    )
    apart = np.linalg.norm(relative(alone.graph.poses[rows], guided.graph.poses[rows])[:, :2], axis=1)
    assert np.sqrt(np.mean(apart**2)) < 0.02
    np.testing.assert_allclose(apart, 0.0, atol=0.05)


LASERS = {
    "180 beams": Laser(),
    "91 beams": Laser(91, -np.pi / 2, np.radians(2), 20.0),
    "541 beams over 270°": Laser(541, -np.radians(135), np.radians(0.5), 20.0),
}


@pytest.mark.parametrize("speed", [0.55, 1.2])
@pytest.mark.parametrize("laser", list(LASERS))
def test_a_bare_corridor_to_a_wall_far_ahead(laser, speed):
    """Up to 17 m of 17 were lost."""
    drive = Drive(speed=speed, period=0.1 if speed > 1.0 else 0.2)
    found, truth, _ = ways_to_the_far_wall(LASERS[laser], drive, 5)
    assert found == pytest.approx(truth, abs=0.05)


@pytest.mark.parametrize("left_out", range(6))
def test_it_does_not_matter_after_which_scan_a_batch_ends(left_out):
    """Where only the last scans of a batch told their place, 13 m of 17 were lost."""
    recording = dataclasses.replace(tee(), drive=Drive(speed=0.55, period=0.2)).record(1)
    log = taken(dataclasses.replace(recording.log(), odometry=None), slice(left_out, None))
    truth = recording.truth[left_out:]
    scans = int(np.argmax(truth[:, 0] > -1.0))
    assert way(mapped(log).graph.poses, scans) == pytest.approx(way(truth, scans), abs=0.05)


@pytest.mark.parametrize("seed", range(1, 9))
def test_with_5_cm_of_noise_the_start_is_told_if_it_is_short(seed):
    """The noise hides the few beams that hit the wall ahead, until it is near."""
    found, truth, said = ways_to_the_far_wall(Laser(noise=0.05), Drive(speed=0.55, period=0.2), seed)
    assert found == pytest.approx(truth, abs=0.3)
    assert abs(found - truth) < 0.1 or "do not show how far the robot went" in said


def ways_to_the_far_wall(laser: Laser, drive: Drive, seed: int) -> tuple[float, float, str]:
    """How far the robot goes to it as mapped without odometry, and in truth (m); what is said."""
    recording = dataclasses.replace(tee(), laser=laser, drive=drive).record(seed)
    run = mapped(dataclasses.replace(recording.log(), odometry=None))
    scans = int(np.argmax(recording.truth[:, 0] > -1.0))
    return way(run.graph.poses, scans), way(recording.truth, scans), "\n".join(notices(run.state))


@pytest.mark.parametrize(
    ("laser", "speed"),
    [
        (Laser(682, -np.radians(120), np.radians(240 / 681), 4.0), 0.55),
        (Laser(726, -np.radians(127.5), np.radians(255 / 725), 5.6), 1.2),
    ],
)
def test_where_neither_side_tells_the_way_a_notice_says_so(laser, speed):
    """14 m are lost, as nothing tells of them; both were silent."""
    drive = Drive(speed=speed, period=0.1 if speed > 1.0 else 0.2)
    recording = dataclasses.replace(tee(), laser=laser, drive=drive).record(5)
    log = dataclasses.replace(taken(recording.log(), slice(None, None, 3)), odometry=None)
    found = mapped(log)
    scans = int(np.argmax(recording.truth[::3, 0] > -1.0))
    assert way(found.graph.poses, scans) < way(recording.truth[::3], scans) - 1.0
    assert any("the walls do not show how far" in said for said in notices(found.state))


@pytest.mark.parametrize("seed", [3, 4])
def test_a_robot_that_turns_by_57_degrees_between_two_scans_turns_as_the_front_sees_it(seed):
    """From behind it turned by 33° the other way, so that the corridor lay across."""
    log, truth = recorded(KINDS[0], seed, NONE)
    rows = np.arange(0, len(log), 5)
    sparse = dataclasses.replace(excerpt(log, rows), odometry=None, odometry_path=None)
    poses = mapped(sparse).graph.poses
    off = relative(poses[1:], poses[:-1]) - relative(truth[rows[1:]], truth[rows[:-1]])
    assert np.degrees(np.abs(wrap(off[:, 2])).max()) < 3.0


def test_a_robot_that_drives_on_after_a_stop_in_a_bare_corridor_does_not_go_slower():
    """From the front its scans fitted as well: the ripple of the walls held it, and 1.4 m were lost."""
    place, how = bare_corridors(1), Drive(0.4, 0.8, 0.13)
    path = driven(place.waypoints, how)
    path = path[: int(0.35 * len(path))]
    stops = [int(share * len(path)) for share in (0.15, 0.4, 0.7, 0.85)]
    truth = np.repeat(path, np.where(np.isin(np.arange(len(path)), stops), 1 + HALT, 1), axis=0)
    recording = drive_through(place, turning(360, 8.0, 0.02, 0.03), how, Odometry(), 1, truth)
    found = mapped(dataclasses.replace(recording.log(), odometry=None)).graph.poses
    ways = [np.linalg.norm(each[50:, :2] - each[:-50, :2], axis=1) for each in (found, truth)]
    assert np.abs(ways[0] - ways[1]).max() < 0.25
    assert rms(found, truth) < 0.1


def test_what_only_fits_as_well_from_behind_is_no_faster_than_the_robot_ever_goes():
    """At 0.2 m/s in a bare corridor a ripple led it 25 m in 20 s."""
    log, truth = recorded(HARD[0], 1, NONE)
    rows = slice(4000, 5500)
    part = dataclasses.replace(excerpt(log, rows), odometry=None, odometry_path=None)
    poses = run_slam(SlamState.of_log(part, SlamOptions()), lambda *_counts: None).poses
    ways, true = (np.hypot(*(each[200:] - each[:-200])[:, :2].T) for each in (poses, truth[rows]))
    assert ways.max() < 1.1 * true.max()
