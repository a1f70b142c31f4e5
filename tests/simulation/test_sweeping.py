"""A laser that turns while the robot drives, beam by beam."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.load import log_from
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import transform
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser, exact
from tests.simulation.other_forms import swept_mcap
from tests.simulation.sweeping import SweptRecording, Turning, fine_path, record_swept
from tests.simulation.world import Builder

LASER = Laser(90, -np.pi, np.radians(4), 12.0)
CORNERS = ((-3.0, -2.0), (4.0, 5.0))


def recorded(turning: Turning, laser: Laser = LASER) -> SweptRecording:
    """A drive with turns in a room."""
    room = Builder()
    room.box(*CORNERS[0], *CORNERS[1])
    path = fine_path(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 3.0)]), Drive(turn_rate=2.0))
    return record_swept("room", room.world(), path, laser, turning, 1)


def off_the_walls(recording: SweptRecording) -> float:
    """m; the greatest distance of a corrected point from the walls, at the true poses."""
    log = recording.log().moving_along(recording.truth)
    worst = 0.0
    for row in range(len(log)):
        x, y = transform(recording.truth[row], log.points(row)).T
        (left, low), (right, high) = CORNERS
        off = np.min(np.abs([x - left, x - right, y - low, y - high]), axis=0)
        worst = max(worst, float(off.max(initial=0.0)))
    return worst


@pytest.mark.parametrize("turning", [
    Turning(), Turning(turn=-0.2), Turning(0.1, 0.1, "middle"), Turning(stamp="last"), Turning(turn=0.0),
])  # fmt: skip
def test_beams_are_cast_from_where_the_laser_is_then(turning):
    """With the poses at the scans alone, turns that begin and end within a scan leave some centimetres."""
    assert off_the_walls(recorded(turning, exact(LASER))) < (0.2 if turning.turn else 1e-6)


def test_a_laser_that_does_not_move_sees_the_same_in_a_turn():
    still = fine_path(np.array([(0.0, 0.0), (0.0, 0.0), (0.5, 0.0)]), Drive(speed=0.01))
    room = Builder()
    room.box(*CORNERS[0], *CORNERS[1])
    one, other = (
        record_swept("room", room.world(), still, exact(LASER), Turning(turn=turn), 1).readings[:9]
        for turn in (0.0, 0.2)
    )
    np.testing.assert_allclose(one[:3], other[1:4], atol=0.02)


@pytest.mark.parametrize(("turning", "said"), [
    (Turning(), {}), (Turning(stamp="last"), {"stamp": "last"}), (Turning(turn=-0.2), {}),
])  # fmt: skip
def test_the_recording_says_it_all(turning, said):
    recording = recorded(turning)
    log = log_from(swept_mcap(recording), "room.mcap", ReadingOptions(**said))
    expected = recording.log()
    assert log.beam_times is not None
    assert expected.beam_times is not None
    np.testing.assert_allclose(log.beam_times.step, expected.beam_times.step, rtol=1e-5)
    np.testing.assert_allclose(log.beam_times.first, expected.beam_times.first, atol=1e-6)
    assert log.odometry_path is not None
    assert recording.odometry.times[1] - recording.odometry.times[0] == pytest.approx(0.05)
    np.testing.assert_allclose(log.odometry_path.times, recording.odometry.times, atol=1e-6)
    np.testing.assert_allclose(log.odometry_path.poses[:, :2], recording.odometry.poses[:, :2], atol=1e-9)


def test_the_options_say_otherwise():
    data = swept_mcap(recorded(Turning()), time_increment=0.0)
    assert log_from(data, "room.mcap").beam_times is None
    swept = log_from(data, "room.mcap", ReadingOptions(sweep=0.2, every=2)).beam_times
    assert swept is not None
    np.testing.assert_allclose(swept.step, 0.2 / 90)
    told = swept_mcap(recorded(Turning()))
    assert log_from(told, "room.mcap", ReadingOptions(sweep=0.0)).beam_times is None


def test_odometry_is_scaled_at_its_own_times_too():
    data = swept_mcap(recorded(Turning()))
    one, other = (log_from(data, "room.mcap", ReadingOptions(odometry_scale=scale)) for scale in (1.0, 2.0))
    assert one.odometry_path is not None
    assert other.odometry_path is not None
    np.testing.assert_allclose(other.odometry_path.poses, one.odometry_path.poses * (2.0, 2.0, 1.0))
    np.testing.assert_allclose(other.odometry_path.twists[:, 2], one.odometry_path.twists[:, 2], atol=1e-9)
