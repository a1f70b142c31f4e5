"""`nscan-cli evaluate` on references of every form, and what it notes of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.poses import compose
from tests.data import data_file
from tests.evaluation.paths import drive, noisy, trajectory
from tests.logs.recordings.test_pose_topics import PLACES, POSE, STAMPS, bag1


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write("result.tum", noisy(drive()))
    write("truth.tum", drive())
    return tmp_path


def write(name: str, poses: np.ndarray) -> None:
    Path(name).write_bytes(write_tum(trajectory(poses).stamps, poses))


def evaluated(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[dict[str, Any], str]:
    capsys.readouterr()
    assert run(["evaluate", *arguments, "--json"]) == 0
    out, err = capsys.readouterr()
    document: dict[str, Any] = json.loads(out)
    return document, err


def test_the_json_has_the_alignment(files, capsys):
    write("moved.tum", compose([3.0, -2.0, 1.0], drive()))
    document, err = evaluated(capsys, "result.tum", "--reference", "moved.tum")
    found = document["reference"]["alignment"]
    assert found["translation"] == pytest.approx([3, -2], abs=0.01)
    assert found["rotation"] == pytest.approx(np.degrees(1), abs=0.1)
    assert (found["rotation_from"], found["pairs"]) == ("positions", 600)
    assert (document["notes"], err) == ([], "")


def test_a_robot_that_turns_on_the_spot_is_aligned_by_headings_and_it_is_said(files, capsys):
    path = np.column_stack([np.zeros((200, 2)), np.linspace(0, 9, 200)])
    write("turns.tum", path + np.random.default_rng(1).normal(0, 0.002, path.shape))
    write("truth.tum", compose([1.0, 2.0, 0.5], path))
    document, _ = evaluated(capsys, "turns.tum", "--reference", "truth.tum")
    assert document["reference"]["alignment"]["rotation_from"] == "headings"
    assert document["reference"]["ate"]["rotation"]["rmse"] < 0.2
    assert run(["evaluate", "turns.tum", "--reference", "truth.tum"]) == 0
    out = capsys.readouterr().out
    assert "alignment  the angle comes from the headings: result and reference move by only\n" in out
    assert max(map(len, out.splitlines())) <= 80


def test_notes_change_no_figure_and_are_quiet_when_asked(files, capsys):
    write("turned.tum", drive() + np.array([0, 0, np.pi / 2]))
    sound, _ = evaluated(capsys, "result.tum", "--reference", "truth.tum")
    document, err = evaluated(capsys, "result.tum", "--reference", "turned.tum")
    (note,) = document["notes"]
    assert note.startswith("the headings differ by 90.0° ± 0.3° throughout: frames turned")
    assert err == f"note: {note}\n"
    assert document["reference"]["ate"]["translation"] == sound["reference"]["ate"]["translation"]
    assert document["reference"]["ate"]["rotation"]["rmse"] == pytest.approx(90, abs=0.1)
    assert evaluated(capsys, "result.tum", "--reference", "turned.tum", "-q")[1] == ""


def test_a_csv_of_euroc_gives_the_same_figures(files, capsys):
    expected, _ = evaluated(capsys, "result.tum", "--reference", "truth.tum")
    lines = ["#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"]
    for line in Path("truth.tum").read_text().splitlines():
        t, x, y, z, qx, qy, qz, qw = line.split()
        lines.append(f"{round(float(t) * 1e9) + 1_700_000_000 * 10**9},{x},{y},{z},{qw},{qx},{qy},{qz}\n")
    Path("data.csv").write_text("".join(lines), encoding="utf-8-sig")
    result = [line.split() for line in Path("result.tum").read_text().splitlines()]
    Path("later.tum").write_text(
        "".join(f"{1_700_000_000 + float(t):.6f} {' '.join(rest)}\n" for t, *rest in result)
    )
    document, err = evaluated(capsys, "later.tum", "--reference", "data.csv")
    assert err == ""
    for kind in ("translation", "rotation"):
        assert document["reference"]["ate"][kind] == pytest.approx(
            expected["reference"]["ate"][kind], abs=1e-6
        )


def test_a_topic_gives_what_a_file_of_its_poses_gives(files, capsys):
    Path("robot.bag").write_bytes(bag1({"/vicon/pose": POSE}, files))
    rows = [" ".join(map(repr, row)) for row in PLACES.tolist()]
    Path("robot.tum").write_text("".join(f"{t} {row}\n" for t, row in zip(STAMPS, rows, strict=True)))
    expected, _ = evaluated(capsys, "robot.tum", "--reference", "robot.tum")
    document, _ = evaluated(
        capsys, "robot.tum", "--reference", "robot.bag", "--reference-topic", "/vicon/pose"
    )
    assert document["reference"].pop("name") == "robot.bag"
    assert expected["reference"].pop("name") == "robot.tum"
    assert document == expected
    assert document["reference"]["matched"] == 5


THERE = "/vicon/pose (PoseStamped, 5 messages)"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["--reference", "robot.bag"],
            f"robot.bag: is a recording; say by --reference-topic which poses are the reference: {THERE}",
        ),
        (
            ["--reference", "robot.bag", "--reference-topic", "/a"],
            f"robot.bag: has no topic /a; --reference-topic can be {THERE}",
        ),
        (
            ["--reference", "truth.tum", "--reference-topic", "/a"],
            "truth.tum: is not a recording and has no topics; leave out --reference-topic",
        ),
        (
            ["--relations", "a.relations", "--reference-topic", "/a"],
            "--reference-topic needs a recording as the reference; give --reference, too",
        ),
    ],
)
def test_a_topic_and_a_recording_belong_together(files, capsys, arguments, said):
    Path("robot.bag").write_bytes(bag1({"/vicon/pose": POSE}, files))
    assert run(["evaluate", "result.tum", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"nscan-cli: {said}\n")


@pytest.mark.logs
def test_a_topic_of_a_real_recording_has_the_poses_of_its_table():
    from nscan_cli.evaluation.load_trajectory import load_reference

    table = load_reference(str(data_file("field/mocap.reference.tum")))
    topic = load_reference(str(data_file("field/mocap.bag")), topic="/vrpn_client_node/jackal/pose")
    np.testing.assert_allclose(topic.times, table.times, atol=1e-6)
    np.testing.assert_allclose(topic.poses, table.poses, atol=1e-9)
