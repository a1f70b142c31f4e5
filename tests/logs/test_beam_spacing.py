"""The angle between beams by the walls: CARMEN's convention is replaced, what a file says is contradicted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import OFFICE_LOG, data_file
from tests.logs import lines
from tests.logs.excerpts import excerpt
from tests.logs.noisy_room import BEAMS, FIRST, STEP, Readings, carmen, readings, recording
from tests.simulation.faults import beams_apart, mirrored_in


def of_view(degrees: float, beams: int) -> Readings:
    """The readings of a laser with so many beams over a field of view, looking ahead."""
    view = math.radians(degrees)
    between = beams if degrees == 360 and beams % 2 == 0 else beams - 1
    return readings(beams=beams, first=-view / 2, step=view / between)


def told(log: LaserLog) -> list[str]:
    return [said for said in log.report.contradictions if "walls are straight" in said]


@pytest.mark.parametrize(
    ("beams", "degrees", "step"),
    [
        (541, 270, 0.5),
        (1081, 270, 0.25),
        (726, 255, 255 / 725),
        (681, 240, 240 / 680),
        (360, 360, 1.0),
        (361, 360, 1.0),
        (181, 240, 240 / 180),
    ],
)
def test_a_laser_that_the_convention_does_not_fit_is_told_by_walls(tmp_path, beams, degrees, step):
    log = lines.read(tmp_path, *carmen(of_view(degrees, beams)))
    assert log.angle_increment == pytest.approx(math.radians(step))
    assert log.angle_min == pytest.approx(-math.radians(degrees) / 2)
    (said,) = told(log)
    assert f"{beams} beams over {degrees}°; " in said
    assert "of the convention for such logs they are bent" in said


@pytest.mark.parametrize("beams", [181, 361, 541])
def test_the_convention_stands_where_walls_are_straight_with_it(tmp_path, beams):
    log = lines.read(tmp_path, *carmen(of_view(180, beams)))
    assert log.angle_increment == pytest.approx(math.pi / (beams - 1))
    assert not told(log)


def test_as_recorded_keeps_the_convention_and_an_option_is_believed(tmp_path):
    scans = carmen(of_view(270, 541))
    recorded = lines.read(tmp_path, *scans, options=ReadingOptions(as_recorded=True))
    chosen = lines.read(tmp_path, *scans, options=ReadingOptions(angle_increment=math.radians(0.4)))
    assert recorded.angle_increment == pytest.approx(math.pi / 540)
    assert chosen.angle_increment == pytest.approx(math.radians(0.4))
    assert not told(recorded)
    assert not told(chosen)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("factor", [0.5, 2 / 3, 1.5, 2.0])
def test_a_wrong_step_of_a_file_is_put_right(read, factor, flip):
    first = -STEP * (BEAMS - 1) / 2
    log = read(recording(readings(first=first), angle_min=factor * first, step=factor * STEP), flip=flip)
    (said,) = told(log)
    assert f"over 360°; with the {2 * factor:.4g}° of the log they are bent: the 2° are used" in said
    sign = -1 if flip else 1
    assert log.angle_increment == pytest.approx(sign * STEP)
    assert log.angle_min == pytest.approx(sign * -math.pi)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize(("first", "beams"), [(0.0, BEAMS), (-0.5 * 152 * STEP, 153)])
def test_where_the_first_beam_or_the_view_is_unusual_options_are_named(read, first, beams, flip):
    """A laser that does not look ahead, and one that sees 304°."""
    ranges = readings(beams=beams, first=first)
    wrong = recording(ranges, angle_min=1.5 * first, step=1.5 * STEP)
    (said,) = told(read(wrong, flip=flip))
    words = said.split("; try ")[1].split()
    assert words[::2] == ["--angle-increment", "--angle-min"][: 1 + (first < 0)]
    angles = [math.radians(float(word)) for word in words[1::2]]
    cured = read(wrong, flip=flip, angle_increment=angles[0], angle_min=angles[1] if first else None)
    assert not told(cured)
    sign = -1 if flip else 1
    assert cured.angle_increment == pytest.approx(sign * angles[0])
    assert abs(angles[0]) == pytest.approx(STEP, rel=0.03)
    assert cured.angle_min == pytest.approx(sign * first, abs=0.03 * abs(first))


@pytest.mark.parametrize("scale", [0.97, 1.03])
def test_a_step_that_is_nearly_right_is_believed(read, scale):
    half = (FIRST / 2, 91)
    ranges = readings(first=half[0], beams=half[1])
    assert not told(read(recording(ranges, angle_min=scale * half[0], step=scale * STEP)))


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("centred", [False, True])
@pytest.mark.parametrize("factor", [0.9, 0.92, 1.08, 1.125])
def test_a_step_that_is_a_tenth_off_is_put_right(read, factor, centred, flip):
    """Whether the file has the right first direction or one that fits its step."""
    # 180 beams, as a SICK: from 90° on the right to 89° on the left.
    first, step, beams = -math.pi / 2, math.pi / 180, 180
    ranges = readings(first=first, step=step, beams=beams)
    start = -factor * step * (beams - 1) / 2 if centred else first
    log = read(recording(ranges, angle_min=start, step=factor * step), flip=flip)
    (said,) = told(log)
    assert f"180 beams over 180°; with the {factor:.4g}° of the log they are bent: the 1° are used" in said
    sign = -1 if flip else 1
    assert log.angle_increment == pytest.approx(sign * step)
    assert log.angle_min == pytest.approx(sign * math.radians(-90.0), abs=1.01 * step)


def test_scans_in_the_other_order_keep_it(tmp_path):
    log = read_log(OFFICE_LOG)
    file = tmp_path / "wrong.log"
    file.write_bytes(with_own_angles(beams_apart(mirrored_in(log, slice(len(log) // 2, None)), 1.1)))
    wrong = read_log(str(file))
    assert len(told(wrong)) == 1
    signs = np.sign(wrong.angle_increment)
    np.testing.assert_array_equal(signs, np.where(np.arange(len(log)) < len(log) // 2, 1, -1))
    assert np.abs(wrong.angle_increment) == pytest.approx(math.radians(1.0))
    assert wrong.angle_min * signs == pytest.approx(math.radians(-90.0), abs=math.radians(1.01))


def test_where_parts_of_a_log_tell_different_steps_none_is_believed(read):
    """Readings of another step in the last two thirds, as if walls were bent there."""
    first, beams = FIRST / 2, 91
    parts = [readings(first=first, beams=beams)[:14]]
    parts += [
        readings(first=first * f, beams=beams, step=f * STEP)[k]
        for k, f in ((slice(14, 27), 0.9), (slice(27, None), 1.1))
    ]
    assert not told(read(recording(np.concatenate(parts), angle_min=first, step=STEP)))


def test_a_robot_that_stands_and_scans_without_walls_tell_nothing(read):
    standing = np.repeat(readings()[:1], 300, axis=0)
    noise = np.random.default_rng(1).uniform(1, 9, (300, 180)).astype(np.float32)
    for ranges in (standing, noise):
        assert not told(read(recording(ranges, step=2 * STEP, angle_min=-STEP * BEAMS)))


@pytest.mark.parametrize("sigma", [0.05, 0.1, 0.2, 0.4])
def test_noise_does_not_look_like_another_angle(read, sigma):
    noise = sigma * np.random.default_rng(5).standard_normal((40, BEAMS)).astype(np.float32)
    assert not told(read(recording(np.maximum(readings() + noise, 0.1), range_max=20.0)))


@pytest.mark.parametrize(
    "name",
    [
        *("mit-csail.log.gz", "fr079.log.gz", "intel.log.gz", "mit-killian.log.gz", "fr-campus.log.gz"),
        *("fr-clinic.log.gz", "field/mocap.bag", "field/old-index.bag", "field/urg-carried.bag"),
        *("field/urg-corridor-1.bag", "field/rplidar-floor", "field/varying-beams.db3"),
    ],
)
def test_walls_do_not_contradict_a_true_log(name):
    assert not told(read_log(str(data_file(name))))


@pytest.mark.parametrize("factor", [0.9, 1.1])
@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel", "mit-killian", "fr-campus"])
def test_a_real_log_with_a_wrong_step_is_put_right(name, factor, tmp_path):
    true = read_log(str(data_file(f"{name}.log.gz")))
    file = tmp_path / "wrong.log"
    file.write_bytes(with_own_angles(beams_apart(true, factor)))
    log = read_log(str(file))
    assert len(told(log)) == 1
    # CARMEN says for some that 180 beams cover 180°, which one step cannot tell.
    assert log.angle_increment == pytest.approx(true.angle_increment, rel=0.006)


@pytest.mark.parametrize("factor", [0.5, 0.9, 2.0])
def test_more_scans_are_looked_at_where_few_walls_are_wide(factor, tmp_path):
    """In narrow corridors with doors 200 scans are too few."""
    true = excerpt(read_log(str(data_file("mit-killian.log.gz"))), slice(2000, 3800))
    file = tmp_path / "wrong.log"
    file.write_bytes(with_own_angles(beams_apart(true, factor)))
    log = read_log(str(file))
    assert len(told(log)) == 1
    assert log.angle_increment == pytest.approx(true.angle_increment, rel=0.006)
