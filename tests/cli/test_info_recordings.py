"""`nscan-cli info` on recordings: what will be used, why, and which option settles what is open."""

from __future__ import annotations

import io
import json
import subprocess
import sys

import pytest
from mcap.reader import make_reader

from nscan_cli.cli.main import run
from tests.logs.recordings.messages import drive
from tests.logs.recordings.ros import ros2


@pytest.fixture
def recording(tmp_path, monkeypatch) -> str:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drive.mcap").write_bytes(ros2(drive()))
    return "drive.mcap"


def test_json(recording, capsys):
    assert run(["info", recording, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    expected = {
        "file": "drive.mcap", "format": "MCAP", "laser": "/scan", "scans": 12, "beams": 5,
        "start": "1700000000.173456789", "rate": 10.0, "mounting": [0.2, 0.1, 17.188734],
        "range_limits": [0.1, 30.000002],
        "used": {
            "laser": "the only topic with scans", "checksums": "they fit",
            "odometry": "/odom, the only topic with odometry, interpolated",
            "mounting": "tf base_link → laser",
            "range_min": "range_min of the messages", "range_max": "range_max of the messages",
        },
        "records": {
            "/odom (nav_msgs/msg/Odometry)": 13, "/scan (sensor_msgs/msg/LaserScan)": 12,
            "/tf_static (tf2_msgs/msg/TFMessage)": 1,
        },
        "skipped": [], "warnings": [],
    }  # fmt: skip
    assert {key: facts[key] for key in expected} == expected


def test_text(recording, capsys):
    assert run(["info", recording]) == 0
    lines = capsys.readouterr().out.splitlines()
    column = lines[0].index("drive.mcap")
    said = [" ".join(line.split()) for line in lines]
    for line in (
        "format MCAP", "checksums they fit", "laser /scan, the only topic with scans", "tf base_link → laser",
        "/odom, the only topic with odometry, interpolated", "12 /scan (sensor_msgs/msg/LaserScan)",
    ):  # fmt: skip
        assert line in said
    assert all(line[column - 1] == " " and line[column] != " " for line in lines)


def test_what_is_skipped_is_counted_in_messages(tmp_path, capsys):
    written = drive()
    written[6] = written[6].with_scan(ranges=[])
    path = tmp_path / "some.mcap"
    path.write_bytes(ros2(written))
    assert run(["info", str(path), "--json"]) == 0
    reason = "the beam count is not in 1…16384"
    assert json.loads(capsys.readouterr().out)["skipped"] == [
        {"reason": reason, "records": 1, "first_message": 3}
    ]
    assert run(["info", str(path)]) == 0
    assert f"1 record: {reason}, first in message 3" in capsys.readouterr().out


def test_a_cut_off_recording(recording, tmp_path, capsys):
    whole = (tmp_path / recording).read_bytes()
    summary = make_reader(io.BytesIO(whole)).get_summary()
    assert summary is not None
    (tmp_path / "cut.mcap").write_bytes(whole[: summary.chunk_indexes[2].chunk_start_offset])
    assert run(["info", "cut.mcap"]) == 65
    assert (
        "the file ends too early; fetch the file again, or use what can be read with --salvage"
        in capsys.readouterr().err
    )
    assert run(["info", "cut.mcap", "--salvage", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert 0 < facts["scans"] < 12
    assert facts["warnings"][0].startswith("damaged: at byte ")


def test_text_logs_need_none_of_the_libraries(tmp_path):
    """Reading CARMEN imports neither mcap nor rosbags nor protobuf; reading ROS needs no protobuf."""
    (tmp_path / "a.log").write_text("FLASER 2 1 2 0 0 0 0 0 0 1.0 h 1.0\n")
    (tmp_path / "a.mcap").write_bytes(ros2(drive()))
    code = (
        "import sys; from nscan_cli.logs.load import read_log; read_log(sys.argv[1]); "
        "print(*sorted({'mcap', 'rosbags', 'google.protobuf', 'sqlite3', 'zstandard'} & set(sys.modules)))"
    )
    for name, loaded in (("a.log", ""), ("a.mcap", "mcap rosbags zstandard")):
        done = subprocess.run(
            [sys.executable, "-c", code, str(tmp_path / name)], capture_output=True, text=True, check=True
        )
        assert done.stdout.strip() == loaded
