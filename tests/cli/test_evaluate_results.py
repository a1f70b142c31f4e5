"""`nscan-cli evaluate` on each form of result: a graph, a TUM trajectory, a log with corrected poses."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.exports.carmen import corrected_log
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import relative
from tests.data import OFFICE_LOG, data_file

END = 20.0
RESULTS = ("graph.json", "path.tum", "corrected.log")


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the three results of the sample's first seconds, and relations from its true poses."""
    folder = tmp_path_factory.mktemp("mapped")
    outputs = ["-o", "graph.json", "--trajectory", "path.tum", "--carmen", "corrected.log"]
    arguments = [part if part.startswith("-") else str(folder / part) for part in outputs]
    assert run(["slam", OFFICE_LOG, "--end", str(END), "-q", *arguments]) == 0
    log = read_log(OFFICE_LOG, ReadingOptions(end=END))
    assert log.truth is not None
    lines = []
    for a, b in zip(range(0, len(log) - 10, 7), range(10, len(log), 7), strict=True):
        x, y, angle = relative(log.truth[b], log.truth[a])
        lines.append(f"{log.stamps[a]} {log.stamps[b]} {x:.6f} {y:.6f} 0 0 0 {angle:.6f}\n")
    (folder / "office.relations").write_text("".join(lines))
    return folder


def figures(capsys: pytest.CaptureFixture[str], result: str, relations: Path) -> dict[str, Any]:
    """What evaluate says of a result on relations."""
    capsys.readouterr()
    assert run(["evaluate", result, "--relations", str(relations), "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    document: dict[str, Any] = json.loads(out)
    return document


def assert_the_same(found: dict[str, Any], expected: dict[str, Any]) -> None:
    """To the nine decimals that poses are written with."""
    for key in ("count", "used", "exact"):
        assert found["relations"][key] == expected["relations"][key]
    assert expected["relations"]["exact"] == expected["relations"]["count"]
    for kind in ("translation", "rotation"):
        assert found["relations"][kind] == pytest.approx(expected["relations"][kind], abs=2e-7)


@pytest.mark.parametrize("name", RESULTS[1:])
def test_every_form_of_a_result_gives_the_same_figures(mapped, capsys, name):
    relations = mapped / "office.relations"
    expected = figures(capsys, str(mapped / "graph.json"), relations)
    assert 0 < expected["relations"]["translation"]["mean"] < 0.1
    found = figures(capsys, str(mapped / name), relations)
    assert found["poses"] == expected["poses"]
    assert_the_same(found, expected)


@pytest.mark.parametrize("name", RESULTS)
def test_all_of_them_may_come_from_standard_input(mapped, capsys, monkeypatch, name):
    relations = mapped / "office.relations"
    expected = figures(capsys, str(mapped / name), relations)
    stdin = io.TextIOWrapper(io.BytesIO((mapped / name).read_bytes()))
    monkeypatch.setattr(sys, "stdin", stdin)
    found = figures(capsys, "-", relations)
    assert found.pop("result") == "standard input"
    assert expected.pop("result") == name
    assert found == expected


@pytest.mark.logs
def test_a_real_log_with_other_poses_gives_the_figures_of_these(tmp_path, capsys):
    """With those of its odometry, the log of fr079, whose laser is not at the robot's centre."""
    log = read_log(str(data_file("fr079.log.gz")))
    relations = data_file("fr079.relations")
    assert log.odometry is not None
    rows = np.arange(len(log))
    (tmp_path / "odometry.tum").write_bytes(write_tum(log.stamps, log.odometry))
    (tmp_path / "odometry.log").write_bytes(corrected_log(log, rows, log.odometry))
    expected = figures(capsys, str(tmp_path / "odometry.tum"), relations)
    assert expected["relations"]["translation"]["mean"] == pytest.approx(6.504, abs=0.1)
    assert_the_same(figures(capsys, str(tmp_path / "odometry.log"), relations), expected)
    back = read_log(str(tmp_path / "odometry.log"), ReadingOptions(allow_corrected=True))
    np.testing.assert_array_equal(back.ranges, log.ranges)
    np.testing.assert_array_equal(back.mount, log.mount)
    assert (back.range_limits, back.no_return) == (log.range_limits, log.no_return)
