"""`nscan-cli calibrate` as a user meets it."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import read_graph
from tests.data import CORRIDOR_LOG, data_file

VALUES = [
    "mount_x", "mount_y", "mount_angle", "odometry_scale", "turn_ratio", "veer", "wheel_difference",
    "track_width", "clock_offset", "noise_distance", "noise_turn",
]  # fmt: skip


def test_json(capsys):
    assert run(["calibrate", CORRIDOR_LOG, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert list(facts) == ["steps", "mirrored", "values", "open", "options", "file", "sha256"]
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
        "mounting",
        "odometry",
        "wheels",
        "noise",
        "clock",
        "unknown",
        "options",
    ]
    assert shown[-1] == "options   --odometry-scale 0.9865"


def test_the_file_is_a_config_of_every_command(tmp_path, capsys):
    robot = tmp_path / "robot.toml"
    assert run(["calibrate", CORRIDOR_LOG, "-o", str(robot)]) == 0
    assert tomllib.loads(robot.read_text()) == {"odometry-scale": 0.9865}
    graph = tmp_path / "graph.json"
    assert run(["slam", CORRIDOR_LOG, "--config", str(robot), "-o", str(graph), "-q"]) == 0
    assert run(["info", CORRIDOR_LOG, "--config", str(robot)]) == 0
    assert read_graph(str(graph)).provenance["parameters"]["reading"]["odometry_scale"] == 0.9865
    capsys.readouterr()


def test_slam_calibrates_first(tmp_path, capsys):
    """A mirrored laser: its map is right at once."""
    graph = tmp_path / "graph.json"
    path = str(data_file("strangers/mirrored.mcap"))
    assert run(["slam", path, "--calibrate", "-o", str(graph)]) == 0
    assert "calibrated: --flip --mount" in capsys.readouterr().err
    reading = read_graph(str(graph)).provenance["parameters"]["reading"]
    assert reading["flip"] is True
    np.testing.assert_allclose(reading["mount"], [0.1, 0, -0.0171], atol=0.003)


@pytest.mark.parametrize("command", ["calibrate", "slam"])
def test_a_log_without_odometry_is_told(command, tmp_path, capsys):
    arguments = ["--calibrate", "-o", str(tmp_path / "g.json")] if command == "slam" else []
    code = run([command, CORRIDOR_LOG, "--no-odometry", *arguments])
    assert code == (65 if command == "calibrate" else 0)
    assert "has no odometry to calibrate; give a log that has it" in capsys.readouterr().err
