"""`nscan-cli info` as a user meets it."""

from __future__ import annotations

import json

import pytest

from nscan_cli.cli.main import run
from tests.logs.lines import flaser

KEYS = [
    "file", "sha256", "bytes", "files", "format", "laser", "scans", "first_scan", "last_scan", "beams",
    "fewest_beams",
    "angle_min", "angle_max", "angle_increment", "angle_increments", "turn", "start", "duration", "rate",
    "longest_gap", "odometry", "no_return",
    "beams_without_return", "beams_unusable", "beams_lost", "mounting", "range_limits", "used", "records",
    "skipped", "backward_stamps", "truth", "warnings", "lasers", "odometries", "corrected",
]  # fmt: skip


@pytest.fixture
def log(tmp_path) -> str:
    lines = [
        "PARAM robot_frontlaser_angular_offset 0.5 nohost 0",
        flaser(10.0, (1, 2, 81.91, 0), (0, 0, 0)),
        flaser(12.0, (1, 2, 81.91, 3), (3, 4, 0)),
        "FLASER 4 1 2",
        flaser(11.0, (1, 2, 81.91, 3), (3, 0, 0)),
        "TRUEPOS 0 0 0 0 0 0 10.0 h 0",
    ]
    path = tmp_path / "small.log"
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def test_json(log, capsys):
    assert run(["info", log, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert list(facts) == KEYS
    # The way 0,0 → 3,0 → 3,4 is 3 m and 4 m long; 3 of 12 beams are lost, 1 is 0.
    expected = {
        "file": "small.log", "format": "CARMEN", "laser": "FLASER", "scans": 3, "first_scan": 0,
        "last_scan": 2, "beams": 4, "angle_min": -90, "angle_max": 90, "angle_increment": 60,
        "start": "10.000000",
        "duration": 2, "rate": 1, "longest_gap": 1, "odometry": {"path": 7}, "no_return": 81.91,
        "beams_without_return": 0.25, "beams_unusable": round(1 / 12, 6), "mounting": [0, 0, 28.647890],
        "range_limits": [0, 80], "records": {"PARAM": 1, "FLASER": 4, "TRUEPOS": 1},
        "skipped": [{"reason": "wrong number of values", "records": 1, "first_line": 4}],
        "backward_stamps": 1, "truth": 1,
        "used": {
            "laser": "the only laser", "mounting": "PARAM", "odometry": "the poses in FLASER",
            "range_min": "none in a CARMEN log", "range_max": "CARMEN's greatest range",
        },
        "fewest_beams": 4, "angle_increments": [60, 60],
        "beams_lost": {"0 or less": 1, "beyond 80 m (CARMEN's greatest range)": 3},
    }  # fmt: skip
    assert {key: facts[key] for key in expected} == expected


def test_text_is_aligned_and_says_the_same(log, capsys):
    assert run(["info", log]) == 0
    lines = capsys.readouterr().out.splitlines()
    column = lines[0].index("small.log")
    assert all(line[column - 1] == " " and line[column] != " " for line in lines)
    text = "\n".join(lines)
    for said in (
        "numbered 0 to 2", "-90° to 90°, 60° a beam", "81.91 m and above", "a path of 7.0 m",
        "turned by 28.6479°", "1 record: wrong number of values, first in line 4",
        "out of order   1 time stamp\n",
        "FLASER, the only laser", "the poses in FLASER", "PARAM",
    ):  # fmt: skip
        assert said in text


def test_the_options_in_force_show(log, capsys):
    arguments = ["--no-odometry", "--max-range", "5", "--start", "1", "--mount", "0,0,90", "--flip"]
    assert run(["info", log, "--json", *arguments]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["odometry"] is None
    assert facts["range_limits"] == [0, 5]
    assert (facts["first_scan"], facts["last_scan"]) == (1, 2)
    assert facts["mounting"] == [0, 0, 90]
    assert facts["angle_min"] == 90


def test_a_single_scan_has_no_rate(tmp_path, capsys):
    path = tmp_path / "one.log"
    path.write_text(flaser(1))
    assert run(["info", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rate"] is None
    assert run(["info", str(path)]) == 0


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["none.log"], 66), (["."], 66), (["empty"], 65), (["small.log", "--strict"], 65),
     (["small.log", "--laser", "RLASER"], 2), (["small.log", "--start", "99"], 2),
     (["small.log", "--max-range", "nan"], 2), (["small.log", "--topic", "/scan"], 2),
     (["small.log", "--odom-topic", "/odom"], 2)],
)  # fmt: skip
def test_mistakes_are_one_line(log, tmp_path, monkeypatch, capsys, arguments, code):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").touch()
    assert run(["info", *arguments]) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
