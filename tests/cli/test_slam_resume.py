"""`nscan-cli slam --from GRAPH` as a user meets it."""

from __future__ import annotations

import gzip
import hashlib
import io
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import relative
from tests.data import OFFICE_LOG
from tests.graph.small_graph import read_tum, small_graph


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the graph of 200 scans of the sample alone."""
    folder = tmp_path_factory.mktemp("saved")
    assert run(["slam", OFFICE_LOG, "--end", "40", "-q", "-o", str(folder / "graph.json")]) == 0
    return folder


@pytest.fixture
def folder(saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with that graph in it."""
    shutil.copy(saved / "graph.json", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_with_its_log_a_graph_is_refined(folder, capsys):
    outputs = {"-o": "again.json", "--map": "again.png", "--trajectory": "again.tum", "--g2o": "again.g2o",
               "--carmen": "again.log", "--depfile": "again.d"}  # fmt: skip
    arguments = [part for pair in outputs.items() for part in pair]
    assert run(["slam", "--from", "graph.json", OFFICE_LOG, *arguments]) == 0
    said = capsys.readouterr().err
    assert re.search(r"^optimised +energy .* iterations, then refined$", said, re.MULTILINE)
    assert re.search(r"^moved +poses by at most \S+ m$", said, re.MULTILINE)
    before, after = load_graph("graph.json"), load_graph("again.json")
    assert after.provenance == before.provenance
    np.testing.assert_allclose(relative(after.poses, before.poses), 0, atol=0.05)
    # The matches are made again: their last digits tell.
    assert len(after.nscan) >= 1
    assert not np.array_equal(after.nscan[0].hessian, before.nscan[0].hessian)
    np.testing.assert_allclose(relative(read_tum("again.tum").poses, after.poses), 0, atol=1e-8)
    corrected = read_log("again.log", ReadingOptions(allow_corrected=True))
    assert corrected.odometry is not None
    np.testing.assert_allclose(relative(corrected.odometry, after.poses), 0, atol=3e-9)
    assert (folder / "again.d").read_text() == (
        f"again.json again.png again.yaml again.tum again.g2o again.log: graph.json {OFFICE_LOG}\n"
    )


@pytest.mark.parametrize("beside", [True, False])
def test_the_log_is_found_beside_the_graph_or_here(folder, tmp_path_factory, monkeypatch, beside):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    shutil.copy(OFFICE_LOG, folder if beside else elsewhere)
    monkeypatch.chdir(elsewhere)
    assert run(["slam", "--from", str(folder / "graph.json"), "-o", "found.json", "-q"]) == 0
    assert run(["slam", "--from", str(folder / "graph.json"), OFFICE_LOG, "-o", "given.json", "-q"]) == 0
    assert (elsewhere / "found.json").read_bytes() == (elsewhere / "given.json").read_bytes()


def test_without_its_log_a_graph_is_optimised_only(folder, capsys):
    """At its minimum already: it stays."""
    assert run(["slam", "--from", "graph.json", "-o", "again.json", "--trajectory", "again.tum"]) == 0
    warning, *summary = capsys.readouterr().err.splitlines()
    assert warning.startswith("warning: optimised but not refined: graph.json: its log office.log.gz is")
    assert any(line.startswith("optimised    energy ") for line in summary)
    assert not any("refined" in line for line in summary)
    before, after = load_graph("graph.json"), load_graph("again.json")
    np.testing.assert_allclose(relative(after.poses, before.poses), 0, atol=1e-4)
    np.testing.assert_array_equal(after.nscan[0].hessian, before.nscan[0].hessian)
    assert after.provenance == before.provenance


@pytest.mark.parametrize("name", ["foreign.json", "foreign.g2o"])
def test_a_graph_of_another_tool_is_optimised_only(folder, capsys, name):
    graph = small_graph()
    (folder / name).write_bytes(write_graph(graph) if name.endswith("json") else write_g2o(graph))
    assert run(["slam", "--from", name, "-o", "again.json"]) == 0
    assert f"{name}: was not made from a log by slam" in capsys.readouterr().err
    assert run(["slam", "--from", name, OFFICE_LOG, "-o", "more.json"]) == 2
    assert not (folder / "more.json").exists()


def test_a_map_needs_the_log(folder, capsys):
    assert run(["slam", "--from", "graph.json", "-o", "again.json", "--map", "again.png"]) == 66
    assert "its log office.log.gz is neither beside it nor in the current folder" in capsys.readouterr().err
    assert not list(folder.glob("again*"))


def test_another_log_is_refused(folder, capsys):
    other = gzip.compress(gzip.decompress(Path(OFFICE_LOG).read_bytes()) + b"# another\n", mtime=0)
    (folder / "office.log.gz").write_bytes(other)
    assert hashlib.sha256(other).hexdigest() != load_graph("graph.json").provenance["inputs"][0]["sha256"]
    for arguments in ([], ["office.log.gz"]):
        assert run(["slam", "--from", "graph.json", *arguments, "-o", "again.json"]) == 65
        assert "office.log.gz: is not the log of graph.json: its SHA-256 differs" in capsys.readouterr().err
        assert not (folder / "again.json").exists()


def test_the_log_that_was_found_is_never_replaced(folder, capsys):
    shutil.copy(OFFICE_LOG, folder)
    assert run(["slam", "--from", "graph.json", "-o", "again.json", "--carmen", "office.log.gz"]) == 2
    assert "office.log.gz is both an input and an output" in capsys.readouterr().err
    assert (folder / "office.log.gz").read_bytes() == Path(OFFICE_LOG).read_bytes()


def test_the_graph_may_come_from_standard_input(folder, monkeypatch):
    shutil.copy(OFFICE_LOG, folder)
    data = (folder / "graph.json").read_bytes()
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(data)))
    assert run(["slam", "--from", "-", "-o", "piped.json", "-q"]) == 0
    assert run(["slam", "--from", "graph.json", "-o", "named.json", "-q"]) == 0
    assert (folder / "piped.json").read_bytes() == (folder / "named.json").read_bytes()


def test_the_same_bytes_every_time(folder):
    for name in ("a.json", "b.json"):
        assert run(["slam", "--from", "graph.json", OFFICE_LOG, "-o", name, "-q"]) == 0
    assert (folder / "a.json").read_bytes() == (folder / "b.json").read_bytes()


def test_how_sure_the_keyframes_are_is_said(folder, capsys):
    """Three in a row, 1 m apart: across, the variances of both steps add up, and that of the first turn.

    √0.04 and √(0.04 + 0.04 + 1/400) are 0.2 and 0.287; of the fourth nobody knows.
    """
    (folder / "row.g2o").write_text(
        "".join(f"VERTEX_SE2 {k} {k} 0 0\n" for k in range(4))
        + "".join(f"EDGE_SE2 {k} {k + 1} 1 0 0 100 0 0 25 0 400\n" for k in range(2))
    )
    assert run(["slam", "--from", "row.g2o", "-o", "row.json"]) == 0
    said = capsys.readouterr().err
    assert "uncertainty  median 0.24 m, worst 0.29 m (scan 2), relative to scan 0\n" in said
    assert "           unknown for 1 keyframe\n" in said


def test_a_single_keyframe_is_where_it_is(folder, capsys):
    (folder / "one.g2o").write_text("VERTEX_SE2 0 0 0 0\n")
    assert run(["slam", "--from", "one.g2o", "-o", "one.json"]) == 0
    assert "sigma" not in capsys.readouterr().err


def test_what_a_g2o_file_has_that_is_not_read_is_said(folder, capsys):
    (folder / "more.g2o").write_text(
        "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 100 0 0 25 0 400\n"
        "EDGE_PRIOR_SE2 0 0 0 0 1000 0 0 1000 0 1000\nVERTEX_XY 9 1 2\nEDGE_SE2_XY 0 9 1 2 10 0 10\n"
    )
    assert run(["slam", "--from", "more.g2o", "-o", "more.json"]) == 0
    warnings = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning: ")]
    assert [warning.split(":")[2] for warning in warnings] == [
        " 1 EDGE_PRIOR_SE2 line skipped",
        " 1 EDGE_SE2_XY line skipped",
        " 1 VERTEX_XY line skipped",
    ]
    assert all(warning.startswith("warning: more.g2o: ") for warning in warnings)
    assert load_graph("more.json").provenance["skipped"] == {
        "EDGE_PRIOR_SE2": 1,
        "EDGE_SE2_XY": 1,
        "VERTEX_XY": 1,
    }
    assert run(["slam", "--from", "more.g2o", "-o", "more.json", "-q"]) == 0
    assert capsys.readouterr().err == ""


def test_keys_of_gtsam_come_back(folder):
    first = 120 << 56
    (folder / "keys.g2o").write_text(
        f"VERTEX_SE2 {first} 0 0 0\nVERTEX_SE2 {first + 1} 1 0 0\n"
        f"EDGE_SE2 {first} {first + 1} 1 0 0 100 0 0 25 0 400\n"
    )
    assert run(["slam", "--from", "keys.g2o", "-o", "keys.json", "-q"]) == 0
    assert run(["slam", "--from", "keys.json", "-o", "again.json", "--g2o", "again.g2o", "-q"]) == 0
    written = (folder / "again.g2o").read_text().splitlines()
    assert [line.split()[1] for line in written[:2]] == [f"{first}", f"{first + 1}"]
    assert written[2].startswith(f"EDGE_SE2 {first} {first + 1} ")
    assert written[3] == f"FIX {first}"
