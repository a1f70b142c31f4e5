"""The options of `nscan-cli slam`, and where they may come from."""

from __future__ import annotations

import tomllib

from nscan_cli.cli.main import run
from nscan_cli.graph.io.load_graph import load_graph
from tests.cli.documents import document_of
from tests.cli.test_slam import SHORT
from tests.data import OFFICE_LOG
from tests.graph.schema import validate


def test_without_odometry(folder):
    assert run(["slam", *SHORT, "--no-odometry", "-o", "graph.json", "-q"]) == 0
    document = document_of(folder / "graph.json")
    validate(document)
    assert not any("odometry" in node for node in document["nodes"])
    assert document["provenance"]["parameters"]["reading"]["odometry"] is False


def test_max_scans_bounds_the_relations(folder):
    assert run(["slam", *SHORT, "--max-scans", "4", "-o", "graph.json", "-q"]) == 0
    graph = load_graph("graph.json")
    assert graph.provenance["parameters"]["slam"]["nscan"]["max_scans"] == 4
    # Fewer where scans did not hang together with the others; two make no joint relation.
    sizes = {len(relation.nodes) for relation in graph.nscan}
    assert min(sizes) >= 3
    assert max(sizes) == 4


def test_relations_of_one_kind(folder):
    assert run(["slam", *SHORT, "--relations", "pairwise", "-o", "pairwise.json", "-q"]) == 0
    assert run(["slam", *SHORT, "--relations", "nscan", "-o", "nscan.json", "-q"]) == 0
    for kind in ("pairwise", "nscan"):
        validate(document_of(folder / f"{kind}.json"))
        assert load_graph(f"{kind}.json").provenance["parameters"]["slam"]["relations"] == kind
    pairwise, nscan = load_graph("pairwise.json"), load_graph("nscan.json")
    assert pairwise.nscan == []
    assert len(pairwise.pairwise) > 1.5 * len(pairwise.keyframes)
    assert len(nscan.nscan) >= 1
    assert len(nscan.pairwise) < len(nscan.keyframes) - 1


def test_no_loops(folder):
    assert run(["slam", OFFICE_LOG, "--every", "10", "--no-loops", "-o", "graph.json", "-q"]) == 0
    graph = load_graph("graph.json")
    assert graph.provenance["parameters"]["slam"]["nscan"]["loops"] is False
    assert graph.loops == []
    assert {relation.origin for relation in graph.nscan} == {"nscan"}


def test_config_is_dumped_and_read_back(folder, capsys):
    given = ["--max-scans", "4", "--map", "map.png", "--every", "7", "--mount", "0.1,0,90"]
    assert run(["slam", OFFICE_LOG, *given, "--dump-config"]) == 0
    dumped = capsys.readouterr().out
    options = tomllib.loads(dumped)["slam"]
    assert (options["max-scans"], options["map"], options["every"]) == (4, "map.png", 7)
    assert options["output"] == "-"
    assert list(folder.iterdir()) == []
    (folder / "slam.toml").write_text(dumped)
    assert run(["slam", OFFICE_LOG, "--config", "slam.toml", "--dump-config"]) == 0
    assert capsys.readouterr().out == dumped
    # A flag is stronger than the file, the file than the default.
    assert run(["slam", OFFICE_LOG, "--config", "slam.toml", "--max-scans", "5", "--dump-config"]) == 0
    assert tomllib.loads(capsys.readouterr().out)["slam"] == {**options, "max-scans": 5}


def test_config_takes_effect(folder):
    (folder / "slam.toml").write_text('end = 20.0\n[slam]\nmax-scans = 3\noutput = "graph.json"\n')
    assert run(["slam", OFFICE_LOG, "--config", "slam.toml", "-q"]) == 0
    graph = load_graph("graph.json")
    assert len(graph) == 101
    assert {len(relation.nodes) for relation in graph.nscan} == {3}
