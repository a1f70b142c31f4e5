"""`nscan-cli calibrate` as a user meets it."""

from __future__ import annotations

import dataclasses
import json
import tomllib

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.logs.load import read_log
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import CORRIDOR_LOG, TURNING_LOG, data_file
from tests.logs.recordings.messages import START, Odom, S, Scan, Tf, Written, turned
from tests.logs.recordings.ros import ros2
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.scenes import office

VALUES = [
    "sweep_time", "mount_x", "mount_y", "mount_angle", "odometry_scale", "turn_ratio", "veer",
    "wheel_difference", "track_width", "clock_offset", "noise_distance", "noise_turn",
]  # fmt: skip


def test_json(capsys):
    assert run(["calibrate", CORRIDOR_LOG, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert list(facts) == [
        "steps",
        "mirrored",
        "sweep",
        "values",
        "open",
        "options",
        "warnings",
        "laser",
        "file",
        "sha256",
    ]
    assert list(facts["values"]) == VALUES
    mounted = facts["values"]["mount_x"]
    assert mounted["recorded"] == 0.1
    assert abs(mounted["value"] - 0.1) < 3 * mounted["sigma"] < 0.03
    assert facts["values"]["mount_angle"]["unit"] == "degrees"
    assert facts["mirrored"] is False
    assert facts["open"] == []
    assert list(facts["options"]) == ["odometry-scale"]


def test_a_table_for_people(capsys):
    assert run(["calibrate", CORRIDOR_LOG]) == 0
    shown = capsys.readouterr().out.splitlines()
    titles = [line.split()[0] for line in shown if not line.startswith(" ")]
    assert titles == [
        "steps",
        "readings",
        "sweep",
        "mounting",
        "odometry",
        "wheels",
        "noise",
        "clock",
        "unknown",
        "options",
    ]
    assert shown[-1] == "options   --odometry-scale 0.987"


def test_the_turn_of_the_laser(tmp_path, capsys):
    assert run(["calibrate", TURNING_LOG, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    turn = facts["values"]["sweep_time"]
    assert turn["recorded"] == 0.2
    assert abs(turn["value"] - 0.2) < 3 * turn["sigma"] < 0.03
    assert facts["sweep"]["used"] == 0.2
    assert facts["sweep"]["stamp"] == "first"
    assert facts["sweep"]["pairs"] >= 30
    robot = tmp_path / "robot.toml"
    assert run(["calibrate", TURNING_LOG, "--sweep", "-0.2", "-o", str(robot)]) == 0
    shown = capsys.readouterr().out
    assert "(file: -0.2)" in shown
    assert "stamp at the first beam" in shown
    assert tomllib.loads(robot.read_text())["sweep"] == 0.2


def test_the_file_is_a_config_of_every_command(tmp_path, capsys):
    robot = tmp_path / "robot.toml"
    assert run(["calibrate", CORRIDOR_LOG, "-o", str(robot)]) == 0
    assert tomllib.loads(robot.read_text()) == {"odometry-scale": 0.987}
    graph = tmp_path / "graph.json"
    assert run(["slam", CORRIDOR_LOG, "--config", str(robot), "-o", str(graph), "-q"]) == 0
    assert run(["info", CORRIDOR_LOG, "--config", str(robot)]) == 0
    assert load_graph(str(graph)).provenance["parameters"]["reading"]["odometry_scale"] == 0.987
    capsys.readouterr()


def test_what_reading_puts_right_is_in_the_file(tmp_path, capsys):
    """Ranges in inches, of a laser that sees two posts of the robot."""
    log = read_log(CORRIDOR_LOG)
    ranges = np.array(log.ranges)
    ranges[:, [20, 21, 22, 150, 151, 152]] = 0.3
    path, robot = tmp_path / "room.log", tmp_path / "robot.toml"
    path.write_bytes(with_own_angles(dataclasses.replace(log, ranges=ranges / np.float32(0.0254))))
    assert run(["calibrate", str(path), "-o", str(robot)]) == 0
    found = tomllib.loads(robot.read_text())
    assert found["range-scale"] == 0.0254
    assert found["mask"].count(":") == 2
    assert "--range-scale 0.0254 --mask" in " ".join(capsys.readouterr().out.split())
    # With it nothing is left to say.
    assert run(["info", str(path), "--config", str(robot)]) == 0
    said = capsys.readouterr()
    assert "are in inches" not in said.out + said.err
    assert "see the robot" not in said.out + said.err


def test_a_mask_with_a_range_stays_in_the_file(tmp_path):
    """An internal error: ranges of sectors had no place in a table."""
    robot = tmp_path / "robot.toml"
    assert run(["calibrate", CORRIDOR_LOG, "--mask", "80:90@1.5", "-o", str(robot)]) == 0
    assert tomllib.loads(robot.read_text())["mask"] == "80:90@1.5"


def test_slam_says_in_its_graph_that_a_log_was_not_calibrated(tmp_path, capsys):
    graph = tmp_path / "graph.json"
    assert run(["slam", CORRIDOR_LOG, "--no-odometry", "--calibrate", "--every", "4", "-o", str(graph)]) == 0
    assert "warning: not calibrated: " in capsys.readouterr().err
    assert any(said.startswith("not calibrated: ") for said in load_graph(str(graph)).provenance["notices"])


def test_slam_calibrates_first(tmp_path, capsys):
    """A mirrored laser: its map is right at once."""
    graph = tmp_path / "graph.json"
    path = str(data_file("strangers/mirrored.mcap"))
    assert run(["slam", path, "--calibrate", "-o", str(graph)]) == 0
    assert "calibrated: --flip --mount" in capsys.readouterr().err
    reading = load_graph(str(graph)).provenance["parameters"]["reading"]
    assert reading["flip"] is True
    np.testing.assert_allclose(reading["mount"], [0.1, 0, -0.0171], atol=0.003)


REAR = (-0.2, 0.1, 3.0)
"""Where the rear laser is, m and rad; the recording has it straight back, 5 cm off."""


@pytest.fixture(scope="module")
def two_lasers(tmp_path_factory) -> str:
    """A drive with a laser in front and one behind, each with its frame and topic; the second 50 ms later."""
    scene = dataclasses.replace(office(), drive=Drive(period=0.05))
    truth, laser = scene.truth()[:1600], Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0)
    front = scene.record_at(truth[::2], 3, dataclasses.replace(laser, mount=(0.2, 0.0, 0.0))).log()
    rear = scene.record_at(truth[1::2], 4, dataclasses.replace(laser, mount=REAR)).log()
    links = ("front", (0.2, 0.0, 0.0), 0.0), ("rear", (-0.25, 0.1, 0.0), np.pi)
    frames = tuple(Tf(START, "base_link", name, place, turned(turn)) for name, place, turn in links)
    written = [Written("/tf_static", START, frames)]
    for name, log, begin in (("front", front, START), ("rear", rear, START + S // 20)):
        for row, time in enumerate(range(begin, begin + len(log) * S // 10, S // 10)):
            scan = Scan(time, log.ranges[row], name, -np.pi, np.radians(1.0), 0.05, 12.0)
            written.append(Written(f"/{name}", time, scan))
            if name == "front":
                assert log.odometry is not None
                written.append(Written("/odom", time, Odom(time, *log.odometry[row].tolist())))
    path = tmp_path_factory.mktemp("two") / "two.mcap"
    path.write_bytes(ros2(sorted(written, key=lambda one: one.log_time)))
    return str(path)


def test_each_of_two_lasers_is_calibrated(two_lasers, capsys):
    assert run(["calibrate", two_lasers, "--json"]) == 0
    front, rear = json.loads(capsys.readouterr().out)["lasers"]
    assert (front["laser"], rear["laser"]) == ("/front", "/rear")
    for found, mount in ((front, (0.2, 0.0, 0.0)), (rear, REAR)):
        values = {name: found["values"][f"mount_{name}"]["value"] for name in ("x", "y", "angle")}
        np.testing.assert_allclose([values["x"], values["y"]], mount[:2], atol=0.01)
        assert abs(values["angle"] - np.degrees(mount[2])) < 0.3
    assert run(["calibrate", two_lasers]) == 0
    assert "laser     /rear" in capsys.readouterr().out


def test_options_are_written_for_one_laser(two_lasers, tmp_path, capsys):
    robot = tmp_path / "robot.toml"
    assert run(["calibrate", two_lasers, "-o", str(robot)]) == 2
    assert "choose one by --topic" in capsys.readouterr().err
    assert run(["calibrate", two_lasers, "--topic", "/rear", "-o", str(robot)]) == 0
    assert tomllib.loads(robot.read_text())["topic"] == "/rear"


@pytest.mark.parametrize("command", ["calibrate", "slam"])
def test_a_log_without_odometry_is_told(command, tmp_path, capsys):
    arguments = ["--calibrate", "-o", str(tmp_path / "g.json")] if command == "slam" else []
    code = run([command, CORRIDOR_LOG, "--no-odometry", *arguments])
    assert code == (65 if command == "calibrate" else 0)
    assert "has no odometry to calibrate; give a log that has it" in capsys.readouterr().err


def test_what_reading_put_right_is_said_too(capsys):
    posts = str(data_file("strangers/posts.mcap"))
    assert run(["calibrate", posts]) == 0
    assert "see the robot itself" in capsys.readouterr().out
    assert run(["calibrate", posts, "--json"]) == 0
    (said,) = json.loads(capsys.readouterr().out)["warnings"]
    assert "as by --mask -138:-132" in said


def test_two_clocks_are_named(capsys):
    assert run(["calibrate", str(data_file("strangers/two-clocks.mcap"))]) == 65
    assert "stamped by two clocks; from their times of recording, --clock-offset" in capsys.readouterr().err
