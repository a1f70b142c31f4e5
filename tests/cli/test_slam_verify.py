"""`nscan-cli slam --verify` and --verify-bound."""

from __future__ import annotations

import json

from nscan_cli.cli.main import run
from nscan_cli.graph.io.load_graph import load_graph
from tests.cli.test_slam import SHORT


def test_differences_are_printed_and_kept(folder, capsys):
    assert run(["slam", *SHORT, "--verify", "-o", "a.json"]) == 0
    said = capsys.readouterr().err
    for change in ("every second scan", "the other scans", "mirrored", "without odometry"):
        assert f"{change}: at most" in " ".join(said.split())
    kept = load_graph("a.json").provenance["verification"]
    assert kept["bound"] is None
    assert kept["greatest"] < 0.3


def test_a_bound_is_a_check(folder, capsys):
    assert run(["slam", *SHORT, "--verify-bound", "5", "-q", "-o", "a.json"]) == 0
    assert run(["slam", *SHORT, "--verify-bound", "1e-6", "-q", "-o", "a.json", "--json"]) == 3
    captured = capsys.readouterr()
    facts = json.loads(captured.out)
    assert facts["verification"]["greatest"] > 1e-6
    assert "maps differ by" in captured.err
    assert "--verify-bound is 1e-06 m" in captured.err
