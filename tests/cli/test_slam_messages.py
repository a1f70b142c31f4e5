"""What a person sees of `nscan-cli slam`: progress on a terminal, and the summary."""

from __future__ import annotations

import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.cli.slam_summary import without_numbers
from nscan_cli.graph.io.load_graph import load_graph
from tests.cli.test_slam import SHORT
from tests.data import OFFICE_LOG


def test_the_summary(folder, capsys):
    assert run(["slam", OFFICE_LOG, "--every", "10", "-o", "graph.json"]) == 0
    out, err = capsys.readouterr()
    assert out == ""
    graph = load_graph("graph.json")
    accepted = sum(loop.accepted for loop in graph.loops)
    refused = len(graph.loops) - accepted
    lines = [line for line in err.splitlines() if not line.startswith("compiling")]
    assert max(map(len, lines)) <= 80
    said = {line[:13].strip(): line[13:] for line in lines if line[:13].strip()}
    assert list(said) == [
        "scans", "keyframes", "relations", "loops", "refused", "uncertainty", "time", "written"
    ]  # fmt: skip
    assert said["scans"] == "252 in 502.0 s"
    assert said["keyframes"] == f"{len(graph.keyframes)}"
    assert said["relations"] == f"{len(graph.pairwise)} pairwise, {len(graph.nscan)} nScan"
    assert len(graph.loops) > 20
    assert said["loops"] == f"{len(graph.loops)} tried, {accepted} accepted, {refused} refused"
    why = [re.match(r"(?:refused)? +(\d+): .", line) for line in lines]
    assert sum(int(match[1]) for match in why if match) == refused
    _first, *others = sorted(graph.marginals)
    sigmas = [float(np.linalg.norm(graph.marginals[node][:2, :2], 2) ** 0.5) for node in others]
    worst = graph.scans[others[int(np.argmax(sigmas))]]
    of_half, most = f"{np.median(sigmas):.2g} m", f"{max(sigmas):.2g} m"
    assert said["uncertainty"] == f"median {of_half}, worst {most} (scan {worst}), relative to scan 0"
    rate = r"\d+ scans a second, \d+ times real time|including the compilation of kernels"
    assert re.fullmatch(rf"[\d.]+ s, ({rate})", said["time"])
    assert said["written"] == "graph.json"


def test_the_graph_keeps_all_that_is_warned_of(folder, capsys):
    """Also what reading has found: here a record that is skipped."""
    text = gzip.decompress(Path(OFFICE_LOG).read_bytes()).splitlines()[:60]
    Path("short.log").write_bytes(b"\n".join([*text, b"FLASER 180 broken"]) + b"\n")
    assert run(["slam", "short.log", "-o", "graph.json", "--json"]) == 0
    warnings = json.loads(capsys.readouterr().out)["warnings"]
    assert any(warning.startswith("1 record skipped") for warning in warnings)
    assert load_graph("graph.json").provenance["notices"] == warnings


def test_more_is_said_when_asked_and_nothing_with_q(folder, capsys):
    assert run(["slam", *SHORT, "-v", "-o", "graph.json"]) == 0
    err = capsys.readouterr().err
    assert re.search(r"^tracking +\d+ starts from other angles, \d+ searches$", err, re.MULTILINE)
    assert re.search(r"^large loops +\d+ keyframes found by search", err, re.MULTILINE)
    assert run(["slam", *SHORT, "-q", "-o", "graph.json"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_graph_is_not_poured_over_a_terminal_unasked(folder, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert run(["slam", *SHORT]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == "nscan-cli: slam: the graph is long; give -o GRAPH.json, or -o - to see it here\n"


def on_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard error is a terminal of 100 columns from now on."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("TERM", "xterm")


def words(shown: str) -> str:
    """What a terminal was sent, without its commands."""
    return re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", shown)


def test_the_progress_has_rate_keyframes_loops_and_time_left(folder, monkeypatch, capsys):
    """And is there on a terminal only: the other tests see no such line."""
    on_terminal(monkeypatch)
    assert run(["slam", *SHORT, "--map", "map.png", "-o", "graph.json"]) == 0
    shown = words(capsys.readouterr().err)
    assert re.search(r"mapping .*201/201 \d+/s \d+ keyframes, \d+ loops? \d:\d\d:\d\d", shown)
    mapping, _, refining = shown.partition("optimising and refining ━")
    assert "201/201" in mapping
    assert refining
    assert "201/201" not in refining


def test_refining_a_saved_graph_shows_that_it_works(folder, monkeypatch, capsys):
    on_terminal(monkeypatch)
    assert run(["slam", *SHORT, "-o", "graph.json", "-q"]) == 0
    again = ["slam", "--from", "graph.json", OFFICE_LOG, "-o", "refined.json"]
    assert run([*again, "-q"]) == 0
    assert capsys.readouterr().err == ""
    assert run(again) == 0
    assert re.search(r"^refining +━", words(capsys.readouterr().err).replace("\r", "\n"), re.MULTILINE)


def test_reasons_that_differ_by_a_number_are_counted_together():
    """In the graph each has its number; the summary has a line for all."""
    alike = {
        "some scans left out": ("1 scan left out", "1 scans left out", "12 scans left out"),
        "only some of the scans match each other": ("only 1 of 9 scans match each other",),
        "too little overlap with some scans of another visit": (
            "too little overlap with 1 scan of another visit",
            "too little overlap with 30 scans of another visit",
        ),
        "did not converge": ("did not converge",),
    }
    for told, reasons in alike.items():
        assert {without_numbers(reason) for reason in reasons} == {told}
