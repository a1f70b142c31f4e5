from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.graph.io.tum import parse_tum, write_tum
from nscan_cli.poses import wrap
from tests.data import data_file
from tests.graph.small_graph import poses, read_tum


def test_a_trajectory_has_these_bytes():
    # sin 45° = cos 45° = 0.70710678118…; −π is π, whose cosine of the half is 0 and not −0.
    data = write_tum(["976052896.784509", "1.5e3"], np.array([[1.0, -0.0, np.pi / 2], [-2.5, 1e-10, -np.pi]]))
    assert data == (
        b"976052896.784509 1.000000000 0.000000000 0 0 0 0.707106781 0.707106781\n"
        b"1.5e3 -2.500000000 0.000000000 0 0 0 1.000000000 0.000000000\n"
    )


@given(st.lists(poses, min_size=1, max_size=8))
def test_what_is_written_reads_back(rows: list[tuple[float, float, float]]):
    stamps = [f"1031745836.{row:06d}" for row in range(len(rows))]
    trajectory = parse_tum(write_tum(stamps, np.array(rows)), "a.tum")
    assert list(trajectory.stamps) == stamps
    np.testing.assert_array_equal(trajectory.times, [float(stamp) for stamp in stamps])
    np.testing.assert_allclose(trajectory.poses[:, :2], np.array(rows)[:, :2], atol=1e-9)
    np.testing.assert_allclose(wrap(trajectory.poses[:, 2] - np.array(rows)[:, 2]), 0, atol=5e-9)


def test_comments_are_skipped_and_poses_sorted_by_time():
    text = b"# t x y z qx qy qz qw\r\n\r\n2 20 0 0 0 0 0 1\r\n1 10 0 9 0 0 0 -1\r\n"
    trajectory = parse_tum(text, "a.tum")
    assert trajectory.stamps == ("1", "2")
    # −q is the same rotation as q; z is left out.
    np.testing.assert_allclose(trajectory.poses, [[10, 0, 0], [20, 0, 0]], atol=1e-15)


def test_of_a_rotation_in_space_the_yaw_is_kept():
    # Yaw 90° after roll 180°: q = q_z(90°) q_x(180°) = (√½, √½, 0, 0) as (x, y, z, w).
    root = 0.7071067811865476
    trajectory = parse_tum(f"0 0 0 0 {root!r} {root!r} 0 0".encode(), "a.tum")
    assert trajectory.poses[0, 2] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("0 0 0 0 0 0 0 1\n0 0 0 0 0 0 1\n", "a.tum, line 2: 7 columns instead of 8"),
        ("0 0 0 0 0 0 0 one", "line 1: could not convert string to float: 'one'"),
        ("0 inf 0 0 0 0 0 1", "line 1: a number is not finite"),
        ("#\n0 0 0 0 0 0 0 0", "line 2: the quaternion is not of length 1"),
        ("# nothing\n", "a.tum: no pose in it"),
    ],
)
def test_a_wrong_line_is_named(text: str, problem: str):
    with pytest.raises(InputDataError, match=problem):
        parse_tum(text.encode(), "a.tum")


def test_a_missing_file_says_so(tmp_path: Path):
    with pytest.raises(InputMissingError, match="no such file"):
        read_tum(str(tmp_path / "a.tum"))


@pytest.mark.logs
def test_the_reference_of_fr_campus_is_read():
    trajectory = read_tum(str(data_file("fr-campus.reference.tum")))
    assert len(trajectory) == 2008
    # Line 2: 2 atan2(−0.065433717, 0.997856918) = −0.13096 rad.
    np.testing.assert_allclose(trajectory.poses[1], [-0.044637, 0.000923, -0.130961], atol=1e-6)
