"""`nscan-cli info` lists what is in a log, where the other commands need an option or refuse it."""

from __future__ import annotations

import dataclasses
import io
import json
import math
from typing import Any

import pytest

from nscan_cli.cli.main import run
from tests.logs.lines import flaser
from tests.logs.recordings.messages import MOUNT, PERIOD, START, Odom, Scan, Tf, Written, drive, turned
from tests.logs.recordings.ros import ros2


def with_more(*topics: tuple[str, type]) -> list[Written]:
    """A drive whose messages of some kinds come on other topics too."""
    more = [
        dataclasses.replace(one, topic=topic)
        for topic, kind in topics
        for one in drive()
        if isinstance(one.content, kind)
    ]
    return sorted(drive() + more, key=lambda one: one.log_time)


@pytest.fixture
def many(tmp_path, monkeypatch) -> str:
    """A recording with two odometries and two lasers; the rear one has fewer beams and half of the rate."""
    monkeypatch.chdir(tmp_path)
    written = with_more(("/rear", Scan), ("/wheels", Odom))
    rear = [one for one in written if one.topic == "/rear"]
    written = [one for one in written if one not in rear[1::2]]
    written = [one.with_scan(ranges=[1.0, 2.0, 3.0]) if one.topic == "/rear" else one for one in written]
    (tmp_path / "many.mcap").write_bytes(ros2(written))
    return "many.mcap"


def facts(capsys, *arguments: str, code: int = 0) -> dict[str, Any]:
    assert run(["info", *arguments, "--json"]) == code
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_all_lasers_are_listed_with_the_option_that_chooses(many, capsys):
    found = facts(capsys, many)
    kind = "sensor_msgs/msg/LaserScan"
    assert found["lasers"] == [
        {
            "name": name,
            "type": kind,
            "records": scans,
            "scans": scans,
            "beams": beams,
            "rate": rate,
            "problem": None,
        }
        for name, scans, beams, rate in (("/rear", 6, 3, 5.0), ("/scan", 12, 5, 10.0))
    ]
    assert [one["name"] for one in found["odometries"]] == ["/odom", "/wheels"]
    assert found["used"]["laser"] == "several; choose one by --topic"
    assert found["used"]["odometry"] == "several; choose one by --odom-topic, or none by --no-odometry"
    # What would be of one laser is of none; what is the recording's is there.
    assert found["laser"] is None
    assert found["scans"] is None
    assert found["mounting"] is None
    assert found["records"]["/wheels (nav_msgs/msg/Odometry)"] == 13

    assert run(["info", many]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for part in (
        "laser several; choose one by --topic",
        "/rear (sensor_msgs/msg/LaserScan): 6 scans of 3 beams, 5 a second",
        "/scan (sensor_msgs/msg/LaserScan): 12 scans of 5 beams, 10 a second",
        "odometry several; choose one by --odom-topic",
        "/wheels (nav_msgs/msg/Odometry): 13 records",
    ):
        assert part in said
    assert "mounting" not in said


def test_what_is_chosen_is_told_as_ever(many, capsys):
    found = facts(capsys, many, "--topic", "scan")
    assert (found["laser"], found["scans"], found["used"]["laser"]) == ("/scan", 12, "chosen by --topic")
    assert found["odometry"] is None
    assert found["used"]["odometry"].startswith("several; ")
    assert len(found["lasers"]) == 2
    found = facts(capsys, many, "--topic", "/rear", "--odom-topic", "wheels")
    assert found["used"]["odometry"] == "/wheels, chosen by --odom-topic, interpolated"
    assert found["mounting"] == [0.2, 0.1, 17.188734]
    assert run(["info", many, "--topic", "/front"]) == 2
    assert "has no topic /front; --topic can be /rear (6 messages)" in capsys.readouterr().err


def test_other_commands_need_the_choice(many, capsys):
    assert run(["match", many, "--reference", "0", "--scan", "1"]) == 2
    assert (
        "has several lasers, /rear (6 messages), /scan (12 messages); choose one" in capsys.readouterr().err
    )


def test_from_standard_input(many, tmp_path, monkeypatch, capsys):
    stdin = io.TextIOWrapper(io.BytesIO((tmp_path / many).read_bytes()))
    monkeypatch.setattr("sys.stdin", stdin)
    assert len(facts(capsys, "-")["lasers"]) == 2


def test_a_laser_that_cannot_be_read_is_listed_too(tmp_path, capsys):
    written = [
        one.with_scan(ranges=[]) if one.topic == "/rear" else one for one in with_more(("/rear", Scan))
    ]
    path = tmp_path / "some.mcap"
    path.write_bytes(ros2(written))
    rear = facts(capsys, str(path), "--topic", "/scan")["lasers"][0]
    assert rear["scans"] is None
    assert "no scan of /rear can be read" in rear["problem"]
    assert run(["info", str(path), "--topic", "/scan"]) == 0
    assert "/rear (sensor_msgs/msg/LaserScan): 12 records; " in " ".join(capsys.readouterr().out.split())


def test_the_first_laser_may_be_the_one_that_cannot_be_read(tmp_path, capsys):
    written = [
        one.with_scan(ranges=[]) if one.topic == "/front" else one for one in with_more(("/front", Scan))
    ]
    path = tmp_path / "some.mcap"
    path.write_bytes(ros2(written))
    assert [one["scans"] for one in facts(capsys, str(path))["lasers"]] == [None, 12]


def test_a_laser_beside_one_that_nods(tmp_path, capsys):
    """As on a PR2: the base's laser is of use, and what the other one does is told where it is listed."""
    tilt = [
        one.with_scan(frame="tilt_laser") if one.topic == "/tilt_scan" else one
        for one in with_more(("/tilt_scan", Scan))
    ]
    for k in range(12):
        at = START + k * PERIOD
        link = Tf(at, "base_link", "tilt_laser", (0, 0, 1), turned(pitch=0.8 - k * 0.1))
        tilt.append(Written("/tf", at, (link,)))
    path = tmp_path / "two.mcap"
    path.write_bytes(ros2(sorted(tilt, key=lambda one: one.log_time)))
    moves = "base_link → tilt_laser moves (tf base_link → tilt_laser)"
    problem = f"its laser nods, from 45.8° down to 17.2° up: {moves}"
    for arguments in ([], ["--topic", "/scan"]):
        found = facts(capsys, str(path), *arguments)
        assert [(one["scans"], one["problem"]) for one in found["lasers"]] == [(12, None), (12, problem)]
    assert found["used"]["mounting"] == "tf base_link → laser"
    assert facts(capsys, str(path), "--topic", "/tilt_scan", code=65)["lasers"][1]["problem"] == problem


def test_both_lasers_of_a_carmen_log(tmp_path, capsys):
    path = tmp_path / "two.log"
    lines = [flaser(k, (1.0, 2.0)) + "\n" + flaser(k, (1.0, 2.0, 3.0), tag="RLASER") for k in range(3)]
    path.write_text("\n".join(lines) + "\n")
    found = facts(capsys, str(path))
    assert found["laser"] == "FLASER"
    assert [(one["name"], one["scans"], one["beams"]) for one in found["lasers"]] == [
        ("FLASER", 3, 2), ("RLASER", 3, 3),
    ]  # fmt: skip
    assert run(["info", str(path)]) == 0
    assert "RLASER: 3 scans of 3 beams, 1 a second" in capsys.readouterr().out


def test_both_lasers_of_a_player_log(tmp_path, capsys):
    lines = [
        f"106738197{k}.05 gates1 6665 laser 0{laser} 106738197{k}.05 -1.5708 +1.5708 +0.7854 0002 1.0 0 2.0 0"
        for k in range(3)
        for laser in range(2)
    ]
    path = tmp_path / "two.log"
    path.write_text("\n".join(lines) + "\n")
    found = facts(capsys, str(path))
    assert [one["name"] for one in found["lasers"]] == ["laser:0", "laser:1"]
    assert found["used"]["laser"] == "several; choose one by --laser"


def test_a_corrected_log_is_described(tmp_path, capsys):
    path = tmp_path / "corrected.log"
    path.write_text("\n".join([flaser(1.5), flaser(2.5, laser=(3, 4, 0)), "NEFF 12.5"]) + "\n")
    found = facts(capsys, str(path))
    assert found["corrected"] == "it has NEFF records"
    assert found["odometry"] == {"path": 5.0}
    needs = "the poses in FLASER; other commands need --allow-corrected or --no-odometry"
    assert found["used"]["odometry"] == needs
    assert found["warnings"] == ["the poses are a mapper's result, not odometry (it has NEFF records)"]
    assert facts(capsys, str(path), "--allow-corrected")["used"]["odometry"] == "the poses in FLASER"
    assert facts(capsys, str(path), "--no-odometry")["used"]["odometry"] == "none: --no-odometry"
    assert run(["match", str(path), "--reference", "0", "--scan", "1"]) == 65
    assert "--allow-corrected to use them as odometry, or --no-odometry" in capsys.readouterr().err


def test_a_laser_that_nods_is_listed_and_refused(tmp_path, capsys):
    nods = []
    for k in range(12):
        at = START + k * PERIOD
        nods.append(Written("/tf", at, (Tf(at, "base_link", "laser", (0, 0, 1), turned(pitch=k * 0.1)),)))
    path = tmp_path / "nods.mcap"
    path.write_bytes(ros2(sorted(drive(mount=()) + nods, key=lambda one: one.log_time)))
    assert run(["info", str(path), "--json"]) == 65
    said = capsys.readouterr()
    found = json.loads(said.out)
    assert (found["scans"], found["mounting"]) == (12, None)
    problem = "its laser nods, from 63.0° down to level: base_link → laser moves (tf base_link → laser)"
    assert found["used"]["mounting"] == f"refused: {problem}"
    assert f"nods.mcap: {problem}; give --mount X,Y,DEG to use a fixed mounting" in said.err


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ((-0.064, 0.0), "0.064 m behind, 0 m to the left, turned by 17.1887°"),
        ((0.2, -0.1), "0.2 m ahead, 0.1 m to the right, turned by 17.1887°"),
    ],
)
def test_where_the_laser_is_in_plain_words(tmp_path, capsys, place, said):
    path = tmp_path / "some.mcap"
    path.write_bytes(ros2(drive(mount=[MOUNT._replace(xyz=(*place, 0.5))])))
    assert run(["info", str(path)]) == 0
    assert said in capsys.readouterr().out
    assert facts(capsys, str(path))["mounting"] == [*place, round(math.degrees(0.3), 6)]
