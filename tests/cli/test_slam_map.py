"""The map and the JSON summary of `nscan-cli slam`."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from nscan_cli.cli.main import run
from nscan_cli.graph.io.load_graph import load_graph
from tests.cli.documents import document_and_notices
from tests.cli.test_slam import SHORT
from tests.mapping.nav2 import load_map


def test_the_map_is_that_of_render_at_the_same_cell_size(folder):
    assert run(["slam", *SHORT, "-q", "-o", "a.json", "--map", "slam.pgm", "--resolution", "0.1"]) == 0
    log = SHORT[0]
    assert run(["render", "a.json", log, "-q", "-o", "render.pgm", "--resolution", "0.1"]) == 0
    assert (folder / "slam.pgm").read_bytes() == (folder / "render.pgm").read_bytes()
    assert "resolution: 0.1\n" in (folder / "slam.yaml").read_text()


def test_a_pgm_is_the_map_of_the_png(folder):
    assert run(["slam", *SHORT, "-q", "-o", "a.json", "--map", "a.png"]) == 0
    assert run(["render", "a.json", SHORT[0], "-q", "-o", "b.PGM"]) == 0
    data = (folder / "b.PGM").read_bytes()
    with Image.open(folder / "a.png") as png, Image.open(folder / "b.PGM") as pgm:
        assert (pgm.format, pgm.mode) == ("PPM", "L")
        assert data.startswith(b"P5\n%d %d\n255\n" % png.size)
        assert np.array_equal(np.asarray(png), np.asarray(pgm))
    assert 'image: "b.PGM"\n' in (folder / "b.yaml").read_text()
    assert np.array_equal(load_map(folder / "a.yaml").data, load_map(folder / "b.yaml").data)


def test_the_summary_as_json(folder, capsys):
    facts, notices = document_and_notices(
        "slam", capsys, *SHORT, "-o", "a.json", "--trajectory", "a.tum", "--json"
    )
    assert notices == [f"warning: {warning}" for warning in facts["warnings"]]
    graph = load_graph("a.json")
    assert (facts["scans"], facts["keyframes"]) == (201, len(graph.keyframes))
    assert (facts["pairwise"], facts["nscan"]) == (len(graph.pairwise), len(graph.nscan))
    assert facts["duration"] == pytest.approx(40.0, abs=0.21)
    loops = facts["loops"]
    assert loops["tried"] == loops["accepted"] + loops["refused"] == len(graph.loops)
    assert loops["accepted"] == sum(loop.accepted for loop in graph.loops)
    assert sum(loops["reasons"].values()) == loops["refused"]
    assert 0 < facts["sigma"]["median"] <= facts["sigma"]["max"] < 0.1
    assert facts["sigma"]["from_scan"] == 0
    assert facts["sigma"]["unknown"] == 0
    assert facts["written"] == ["a.json", "a.tum"]
    assert set(facts["tracking"]) == {"restarts", "searches", "places"}
    assert facts["optimised"] is None


def test_a_saved_graph_has_the_same_keys(folder, capsys):
    assert run(["slam", *SHORT, "-q", "-o", "a.json", "--g2o", "a.g2o"]) == 0
    assert run(["slam", *SHORT, "-q", "-o", "b.json", "--json"]) == 0
    mapped = json.loads(capsys.readouterr().out)
    facts, _notices = document_and_notices("slam", capsys, "--from", "a.g2o", "-o", "c.json", "--json")
    assert list(facts) == list(mapped)
    assert facts["optimised"]["refined"] is False
    assert facts["optimised"]["moved"] < 0.05
    assert facts["tracking"] is None
    assert facts["duration"] is None


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--json"], "slam: --json prints the summary to standard output; give -o GRAPH.json, too"),
        (["-o", "a.json", "--resolution", "0.1"], "slam: --resolution is that of the map"),
        (["-o", "a.json", "--map", "a.tif"], "a.tif: maps are PNG or PGM; name it like a.png"),
    ],
)
def test_what_cannot_be_is_refused_first(folder, capsys, arguments, said):
    assert run(["slam", *SHORT, *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert err.count("\n") == 1
    assert not list(folder.iterdir())
