"""`nscan-cli slam` as a user meets it."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import relative
from tests.cli.documents import document_of
from tests.cli.room_logs import ALL_OUTPUTS, room_log
from tests.data import OFFICE_LOG
from tests.graph.schema import validate
from tests.graph.small_graph import read_tum

SHORT = [OFFICE_LOG, "--end", "40"]
"""200 scans, 15 m."""


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all outputs of a run over the short log."""
    folder = tmp_path_factory.mktemp("everything")
    files = {"-o": "graph.json", "--map": "map.png", "--trajectory": "path.tum", "--g2o": "graph.g2o",
             "--carmen": "corrected.log", "--depfile": "graph.d"}  # fmt: skip
    arguments = [part for option, name in files.items() for part in (option, str(folder / name))]
    assert run(["slam", *SHORT, "-q", *arguments]) == 0
    return folder


def test_outputs_appear_whole_and_nothing_else(everything):
    names = ["corrected.log", "graph.d", "graph.g2o", "graph.json", "map.png", "map.yaml", "path.tum"]
    assert sorted(path.name for path in everything.iterdir()) == names


def test_the_graph_is_valid_against_the_schema(everything):
    document = document_of(everything / "graph.json")
    validate(document)
    assert [node["scan"] for node in document["nodes"]] == list(range(201))
    assert {relation["type"] for relation in document["relations"]} == {"pairwise", "nscan"}
    assert (everything / "graph.json").read_bytes() == write_graph(load_graph(str(everything / "graph.json")))


def test_the_graph_is_of_the_log(everything):
    graph = load_graph(str(everything / "graph.json"))
    log = read_log(OFFICE_LOG, ReadingOptions(end=40.0))
    assert log.truth is not None
    truth = log.truth[: len(log)]
    assert graph.stamps == list(log.stamps)
    assert log.odometry is not None
    assert graph.odometry is not None
    np.testing.assert_allclose(graph.odometry, log.odometry, atol=1e-9)
    off = relative(graph.poses, graph.poses[0]) - relative(truth, truth[0])
    assert np.hypot(off[:, 0], off[:, 1]).mean() < 0.3


def test_trajectory_and_g2o_are_those_of_the_graph(everything):
    graph = load_graph(str(everything / "graph.json"))
    path = read_tum(str(everything / "path.tum"))
    assert list(path.stamps) == graph.stamps
    np.testing.assert_allclose(relative(path.poses, graph.poses), 0, atol=1e-8)
    g2o = load_graph(str(everything / "graph.g2o"))
    np.testing.assert_allclose(relative(g2o.poses, graph.poses[graph.keyframes]), 0, atol=1e-6)


def test_the_corrected_log_has_the_graphs_poses_and_the_logs_scans(everything):
    graph = load_graph(str(everything / "graph.json"))
    log = read_log(OFFICE_LOG, ReadingOptions(end=40.0))
    corrected = read_log(str(everything / "corrected.log"), ReadingOptions(allow_corrected=True))
    assert corrected.stamps == log.stamps
    np.testing.assert_array_equal(corrected.ranges, log.ranges)
    np.testing.assert_allclose(corrected.mount, log.mount, atol=1e-6)
    assert corrected.odometry is not None
    np.testing.assert_allclose(relative(corrected.odometry, graph.poses), 0, atol=3e-9)


def test_the_map_is_of_the_floor_and_its_yaml_beside_it(everything):
    with Image.open(everything / "map.png") as image:
        shades, counts = np.unique(np.asarray(image), return_counts=True)
        width, height = image.size
    assert shades.tolist() == [0, 205, 254]
    # The robot sees more than the corridor that it drives, and not beyond the building of 40 × 25 m.
    assert counts[2] * 0.05**2 > 50
    assert max(width, height) * 0.05 < 50
    yaml = (everything / "map.yaml").read_text()
    assert re.search(r'^image: "?map\.png"?$', yaml, re.MULTILINE)
    assert "resolution: 0.05\n" in yaml


def test_provenance_has_the_inputs_sha256_and_all_parameters_and_no_path(everything):
    text = (everything / "graph.json").read_text()
    provenance = json.loads(text)["provenance"]
    data = Path(OFFICE_LOG).read_bytes()
    assert provenance["inputs"] == [
        {"name": "office.log.gz", "sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
    ]
    assert provenance["parameters"]["reading"]["end"] == 40
    slam = provenance["parameters"]["slam"]
    assert slam["nscan"]["max_scans"] == 10
    assert {"tracking", "keyframes", "nscan"} <= set(slam)
    assert str(everything) not in text
    assert str(Path(OFFICE_LOG).parent) not in text
    assert not re.search(r'"[^"]*/[^"]*"', text)


def rule(text: str) -> tuple[list[str], list[str]]:
    """Targets and prerequisites of make's rule."""
    assert text.endswith("\n")
    assert text.count("\n") == 1
    targets, _, sources = text.rstrip("\n").partition(": ")

    def names(part: str) -> list[str]:
        found = re.split(r"(?<!\\) ", part)
        return [name.replace("\\ ", " ").replace("\\#", "#").replace("$$", "$") for name in found]

    return names(targets), names(sources)


def test_the_depfile_names_every_output_and_the_log(everything):
    targets, sources = rule((everything / "graph.d").read_text())
    outputs = ("graph.json", "map.png", "map.yaml", "path.tum", "graph.g2o", "corrected.log")
    assert sorted(targets) == sorted(str(everything / name) for name in outputs)
    assert sources == [OFFICE_LOG]


def test_make_understands_the_depfile(folder):
    """The graph is made again when the log is newer, and only then; whatever is in the names."""
    log, graph = folder / "my $log #1.gz", folder / "the graph.json"
    log.write_bytes(gzip.compress(room_log(5).encode(), mtime=0))
    assert run(["slam", log.name, "-o", graph.name, "--depfile", "graph.d", "-q"]) == 0
    assert rule((folder / "graph.d").read_text()) == ([graph.name], [log.name])
    make = shutil.which("make")
    if make is None:
        pytest.skip("make is not installed")
    (folder / "Makefile").write_text("the\\ graph.json:\n\t@echo made again\ninclude graph.d\n")
    for newer, older, said in ((graph, log, "up to date"), (log, graph, "made again")):
        os.utime(older, (1e9, 1e9))
        os.utime(newer, (1e9 + 5, 1e9 + 5))
        made = subprocess.run([make, graph.name], cwd=folder, capture_output=True, text=True, check=True)
        assert said in made.stdout


def test_standard_input_is_no_file_for_make(folder, monkeypatch):
    data = room_log(3).encode()
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(data)))
    assert run(["slam", "-", "-o", "graph.json", "--depfile", "graph.d", "-q"]) == 0
    assert (folder / "graph.d").read_text() == "graph.json:\n"


def test_standard_output_gets_the_graph_and_nothing_else(everything, capsysbinary):
    assert run(["slam", *SHORT]) == 0
    out, err = capsysbinary.readouterr()
    assert out == (everything / "graph.json").read_bytes()
    assert b"keyframes" in err
    assert run(["slam", *SHORT, "-o", "-", "-q"]) == 0
    assert capsysbinary.readouterr() == (out, b"")


def test_the_log_may_come_from_standard_input(folder, everything, monkeypatch):
    stdin = SimpleNamespace(buffer=io.BytesIO(Path(OFFICE_LOG).read_bytes()))
    monkeypatch.setattr("sys.stdin", stdin)
    assert run(["slam", "-", "--end", "40", "-o", "graph.json", "-q"]) == 0
    found, named = (document_of(path) for path in (folder / "graph.json", everything / "graph.json"))
    assert found["provenance"]["inputs"][0]["name"] == "standard input"
    assert found["nodes"] == named["nodes"]


def test_the_same_bytes_every_time(folder, everything):
    assert run(["slam", *SHORT, "-o", "a.json", "--map", "a.png", "-q"]) == 0
    assert (folder / "a.json").read_bytes() == (everything / "graph.json").read_bytes()
    assert (folder / "a.png").read_bytes() == (everything / "map.png").read_bytes()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_logs_of_a_few_scans(folder, capsys, count):
    (folder / "few.log").write_text(room_log(count))
    assert run(["slam", "few.log", *ALL_OUTPUTS]) == 0
    validate(document_of(folder / "out.json"))
    said = capsys.readouterr().err
    assert f"scans      {count} in" in said
    assert "keyframes  1\n" in said
    assert "loops      none tried\n" in said
    assert (folder / "out.png").exists()
