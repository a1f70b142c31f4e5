"""docs/graph.md names every key of the graph's schema and no other, and its lines run."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli.cli.main import run
from tests.data import CORRIDOR_LOG, PACKAGE, REPOSITORY
from tests.docs.blocks import blocks

PAGE = (REPOSITORY / "docs" / "graph.md").read_text()
SCHEMA = json.loads((PACKAGE / "graph" / "io" / "pose-graph.schema.json").read_text())
OF_TABLES = {"provenance": "provenance", "nodes": "node", "loops": "loop", "marginals": "marginal"}
"""Tables of the page, and the definitions of the schema that they describe."""


def told(title: str) -> set[str]:
    """The keys in the table that follows a title."""
    table = PAGE.partition("## Every key")[2].partition(f"\n{title}")[2].partition("\n|---|---|\n")[2]
    rows = table.partition("\n\n")[0].splitlines()
    return {key for row in rows for key in re.findall(r"`([$\w]+)`", row.split(" | ")[0])}


def test_every_key_is_told_and_no_other():
    assert told("At the top") == set(SCHEMA["properties"])
    for title, name in OF_TABLES.items():
        assert told(f"`{title}`") == set(SCHEMA["$defs"][name]["properties"]), title
    common = told("`relations`, all types")
    assert common == set(SCHEMA["$defs"]["relation"]["properties"])
    for kind in ("pairwise", "nscan"):
        assert common | told(f"`{kind}` relations") == set(SCHEMA["$defs"][kind]["properties"])


def test_the_lines_load_and_plot_a_graph(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    assert run(["slam", CORRIDOR_LOG, "-o", "office.json", "-q"]) == 0
    session: dict[str, Any] = {}
    for block in blocks("docs/graph.md", "python"):
        exec(block, session)
    assert len(session["x"]) == 238
    first, *_ = session["graph"]["marginals"]
    upper = session["graph"]["marginals"][-1]["covariance"]
    assert first["covariance"] == [0.0] * 6
    np.testing.assert_allclose(session["covariance"][0], upper[:3])
    np.testing.assert_allclose(session["covariance"][:, 2], [upper[2], upper[4], upper[5]])
    assert capsys.readouterr().out.endswith("m, m, rad\n")
    assert {path.name for path in Path().glob("*.png")} == {"path.png", "loops.png"}
