"""`nscan-cli info` on readings: which limits hold and why, what is lost and why, and what is left."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.cli.main import run
from tests.logs.noisy_room import carmen, readings, recording
from tests.logs.recordings.messages import Scan
from tests.logs.recordings.ros import ros2


@pytest.fixture
def millimetres(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mm.mcap").write_bytes(ros2(recording(1000 * readings())))
    return "mm.mcap"


SAID = (
    "mm.mcap: none of its 7,200 readings is usable: 7,200 are beyond 12 m (range_max of the messages); half "
    "of the returns are beyond "
)


@pytest.mark.parametrize(
    "arguments",
    [["slam", "-o", "graph.json"], ["match", "--reference", "0", "--scan", "1"], ["nscan", "--scans", "0-3"]],
)
def test_a_log_of_which_no_reading_counts_is_bad_data(millimetres, capsys, arguments):
    assert run([arguments[0], millimetres, "--as-recorded", *arguments[1:]]) == 65
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"nscan-cli: {SAID}")
    assert len(captured.err.splitlines()) == 1
    assert not Path("graph.json").exists()


def test_info_lists_it_and_then_refuses_it(millimetres, capsys):
    assert run(["info", millimetres, "--as-recorded"]) == 65
    captured = capsys.readouterr()
    assert "100.0% without return" in captured.out
    assert "7,200 beyond 12 m (range_max of the messages)" in captured.out
    assert captured.err.startswith(f"nscan-cli: {SAID}")
    assert run(["info", "--json", millimetres, "--as-recorded"]) == 65
    facts = json.loads(capsys.readouterr().out)
    assert facts["beams_lost"] == {"beyond 12 m (range_max of the messages)": 7200}


def test_a_unit_that_is_put_right_is_among_the_warnings(millimetres, capsys):
    assert run(["info", "--json", millimetres]) == 0
    (warning,) = json.loads(capsys.readouterr().out)["warnings"]
    assert "the ranges are multiplied by 0.001" in warning


def test_the_source_of_each_limit(tmp_path, capsys):
    path = tmp_path / "a.log"
    path.write_text("\n".join(carmen(np.minimum(readings(), 8), "robot_front_laser_max 8.0")) + "\n")
    assert run(["info", str(path)]) == 0
    said = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    at = said.index("range limits 0 m to 8 m")
    assert said[at + 1] == "lower: none in a CARMEN log"
    assert said[at + 2] == "upper: PARAM robot_front_laser_max, at a peak of readings without"
    assert "no return 8 m and above" in said
    assert run(["info", str(path), "--json", "--max-range", "5", "--min-range", "0.2"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["range_limits"] == [0.2, 5]
    assert (facts["used"]["range_min"], facts["used"]["range_max"]) == ("--min-range", "--max-range")
    assert list(facts["beams_lost"]) == ["beyond 5 m (--max-range)"]


def test_scans_of_different_lengths_show_as_such(tmp_path, capsys):
    written = recording(readings(), range_max=20.0)
    for at in range(3, len(written), 4):
        scan = written[at].content
        assert isinstance(scan, Scan)
        written[at] = written[at].with_scan(ranges=scan.ranges[::2], step=2 * scan.step)
    path = tmp_path / "a.mcap"
    path.write_bytes(ros2(written))
    assert run(["info", str(path)]) == 0
    said = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "beams 90 to 180" in said
    assert "field of view -180° to 178°, 2° to 4° a beam" in said
    assert "beams lost 0.0% without return, 0.0% unusable" in said
