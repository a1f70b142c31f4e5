"""Tables of poses as other tools write them: separators, headers, columns, units of time."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.graph.io.pose_columns import is_pose_table
from nscan_cli.graph.io.tum import parse_tum

# Two poses: yaw 90° and 180°, at 1403636580.838555574 and .938555574 s.
ROOT = 0.70710678
TIMES = ["1403636580.838555574", "1403636580.938555574"]
PLACES = [(1.5, -2.25, 0.5), (2.5, 3.0, 0.5)]
TURNS = [(0.0, 0.0, ROOT, ROOT), (0.0, 0.0, 1.0, 0.0)]
EUROC_HEAD = (
    "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],"
    "v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],"
    "b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]\n"
)


def table(
    between: str = " ", order: str = "txyzabcw", power: int = 0, head: str = "", end: str = "\n"
) -> str:
    """The poses as text, head included; a, b, c, w are the quaternion."""
    lines = [head]
    for time, place, turn in zip(TIMES, PLACES, TURNS, strict=True):
        whole, rest = time.split(".")
        values = dict(zip("xyzabcw", map(str, place + turn), strict=True))
        values |= {
            "t": whole + rest[:power] if power else time,
            "0": "0.1",
            "f": "map",
            "s": whole,
            "n": rest,
        }
        lines.append(between.join(values[one] for one in order) + end)
    return "".join(lines)


FORMS = {
    "tabs": table("\t"),
    "commas": table(", "),
    "Windows": table(",", end="\r\n"),
    "semicolons and decimal commas": table(";").replace(".", ","),
    "byte-order mark": "\ufeff" + table(),
    "byte-order mark and header": "\ufeff" + table(",", head="timestamp,tx,ty,tz,qx,qy,qz,qw\n"),
    "trailing comma": table(",", end=",\n"),
    "comment": table(head="# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n"),
    "header with spaces": table(head="time x y z q_x q_y q_z q_w\n"),
    "quoted header": table(",", head='"timestamp","x","y","z","qx","qy","qz","qw"\n'),
    "w first, by name": table(",", "txyzwabc", head="t,x,y,z,qw,qx,qy,qz\n"),
    "w first, in a comment": table(" ", "txyzwabc", head="# timestamp x y z qw qx qy qz\n"),
    "no z": table(",", "txyabcw", head="t,x,y,qx,qy,qz,qw\n"),
    "EuRoC": table(",", "txyzwabc000000000", 9, EUROC_HEAD),
    "EuRoC without a header": table(",", "txyzwabc000000000", 9),
    "EuRoC's first columns": table(",", "txyzwabc", 9),
    "ns in TUM's order": table(" ", power=9),
    "µs": table(" ", power=6),
    "ms": table(" ", power=3),
    "rostopic echo -p": table(
        ",", "t0fxyzabcw0", 9,
        "%time,field.header.seq,field.header.frame_id,field.pose.pose.position.x,field.pose.pose.position.y,"
        "field.pose.pose.position.z,field.pose.pose.orientation.x,field.pose.pose.orientation.y,"
        "field.pose.pose.orientation.z,field.pose.pose.orientation.w,field.pose.covariance0\n",
    ),
    "seconds and nanoseconds": table(
        ",", "snfxyzabcw",
        head="header.stamp.sec,header.stamp.nanosec,header.frame_id,pose.position.x,pose.position.y,"
        "pose.position.z,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w\n",
    ),
}  # fmt: skip
DIGITS = {"µs": 6, "ms": 3}


@pytest.mark.parametrize("name", FORMS)
def test_every_form_gives_the_same_poses(name: str):
    data = FORMS[name].encode()
    assert is_pose_table(data)
    found = parse_tum(data, "a.csv")
    np.testing.assert_allclose(found.poses, [[1.5, -2.25, np.pi / 2], [2.5, 3.0, np.pi]], atol=1e-7)
    digits = DIGITS.get(name, 9)
    assert [stamp.replace(",", ".") for stamp in found.stamps] == [time[: 11 + digits] for time in TIMES]
    np.testing.assert_allclose(found.times, [float(time) for time in TIMES], atol=1e-3)
    assert found.spatial is not None
    height = 0.0 if name == "no z" else 0.5
    np.testing.assert_allclose(found.spatial, [[height, 0, 0, 1]] * 2, atol=1e-7)


def test_times_of_a_simulation_in_ns_are_known_by_their_header():
    found = parse_tum(
        b"#timestamp [ns],p_x,p_y,p_z,q_w,q_x,q_y,q_z\n0,0,0,0,1,0,0,0\n50000000,1,0,0,1,0,0,0\n", "a"
    )
    assert found.times.tolist() == [0.0, 0.05]


@pytest.mark.parametrize(
    "text",
    ["PARAM robot_length 1\nFLASER 1 2\n", "# a log\nODOM 1 2 3\n", "## Player version 2.0\n", "", "\n# x\n",
     "date,x,y,z\n1,2,3,4\n", "time,quality,x,y\n1,2,3,4\n"],
)  # fmt: skip
def test_what_is_no_table_of_poses(text: str):
    assert not is_pose_table(text.encode())


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("t,x,y,z,qx,qy,qz,qw\n1,2,3\n", "a.csv, line 2: 3 columns instead of 8"),
        (table(",", head="t,x,y,z,qx,qy,qz,qw\n") + "1,2,3,4,0,0,0\n", "line 4: 7 columns instead of 8"),
        (table() + "soon 0 0 0 0 0 0 1\n", "line 3: could not convert string to float: 'soon'"),
        ("1,2,3,4,5,6,7\n", "line 1: 7 columns instead of 8"),
        (
            table(",", "txyzwabc000000000", 9, EUROC_HEAD).replace("1.5", "nan"),
            "line 2: a number is not finite",
        ),
    ],
)
def test_a_wrong_line_is_named(text: str, problem: str):
    with pytest.raises(InputDataError, match=problem):
        parse_tum(text.encode(), "a.csv")


def test_the_direction_upwards_is_that_of_the_body():
    """Pitch by 90° (nose down): up is where the back of the robot points."""
    found = parse_tum(f"0 0 0 2 0 {ROOT} 0 {ROOT}\n".encode(), "a.tum")
    assert found.spatial is not None
    np.testing.assert_allclose(found.spatial, [[2, -1, 0, 0]], atol=1e-7)
