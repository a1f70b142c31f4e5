"""The public Python API: docs/python.md at work, and the same results as the commands."""

from __future__ import annotations

import inspect
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import nscan_cli
from nscan_cli.cli.main import run
from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.laser_log import LaserLog
from tests.data import CORRIDOR_LOG, REPOSITORY, SAMPLE_LOGS
from tests.docs.blocks import blocks

MEANT = """
import sys
before = set(sys.modules)
import nscan_cli
print(*sorted(set(sys.modules) - before))
"""


def test_the_import_imports_nothing_else():
    done = subprocess.run([sys.executable, "-c", MEANT], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) <= {"nscan_cli", "__future__"}


def test_every_public_name_is_there_typed_and_described():
    assert len(nscan_cli.__all__) <= 10
    page = (REPOSITORY / "docs" / "python.md").read_text()
    for name in nscan_cli.__all__:
        assert f"`{name}(" in page, name
        found = getattr(nscan_cli, name)
        assert inspect.getdoc(found), name
        assert name in dir(nscan_cli)
        if inspect.isfunction(found):
            signature = inspect.signature(found)
            annotations = [each.annotation for each in signature.parameters.values()]
            assert inspect.Signature.empty not in [*annotations, signature.return_annotation], name
    with pytest.raises(AttributeError, match="no attribute 'build_map'"):
        _ = nscan_cli.build_map


def test_the_page_runs_as_it_stands(tmp_path, monkeypatch, capsys):
    shutil.copytree(SAMPLE_LOGS, tmp_path / "sample_logs")
    monkeypatch.chdir(tmp_path)
    session: dict[str, Any] = {}
    for block in blocks("docs/python.md", "python"):
        exec(block, session)
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "2520 scans of 180 beams"
    assert session["pair"].converged
    assert session["left_out"] == []
    with Image.open("office.png") as picture:
        assert {gray for _, gray in picture.getcolors() or []} == {0, 205, 254}


@pytest.fixture
def corridor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LaserLog:
    monkeypatch.chdir(tmp_path)
    shutil.copy(CORRIDOR_LOG, "robot.log.gz")
    options = nscan_cli.ReadingOptions(max_range=20.0)
    return nscan_cli.read_log("robot.log.gz", options)


def test_the_graph_and_its_map_are_those_of_the_commands(corridor):
    assert run(["slam", "robot.log.gz", "--max-range", "20", "-o", "slam.json", "--map", "map.png"]) == 0
    graph = nscan_cli.build_graph(corridor, threads=1)
    nscan_cli.save_graph(graph, "api.json")
    assert Path("api.json").read_bytes() == Path("slam.json").read_bytes()
    states = nscan_cli.make_grid(corridor, graph).states()
    with Image.open("map.png") as picture:
        gray = np.asarray(picture)[::-1]
    np.testing.assert_array_equal(np.select([states == 100, states == 0], [0, 254], 205), gray)


@pytest.mark.parametrize("prior", ["odometry", "none"])
def test_matches_are_those_of_the_commands(corridor, prior):
    same = ["robot.log.gz", "--max-range", "20", "--prior", prior, "-q"]
    assert run(["match", *same, "--reference", "100", "--scan", "104", "-o", "match.json"]) == 0
    assert run(["nscan", *same, "--scans", "100-108:4", "-o", "nscan.json"]) == 0
    use = prior == "odometry"
    pair = nscan_cli.match(corridor, 100, 104, odometry=use)
    joint, left_out = nscan_cli.nscan(corridor, [100, 104, 108], odometry=use)
    assert joint is not None
    assert left_out == []
    match, nscan = (json.loads(Path(name).read_text()) for name in ("match.json", "nscan.json"))
    np.testing.assert_allclose(pair.pose, match["pose"], atol=1e-9)
    np.testing.assert_allclose(joint.poses, nscan["relation"]["poses"], atol=1e-9)
    assert joint.joint.evaluations == nscan["evaluations"]


def test_initial_poses_are_taken(corridor):
    pair = nscan_cli.match(corridor, 100, 104, initial=np.array([0.3, 0.1, 0.5]), odometry=False)
    np.testing.assert_allclose(pair.pose, nscan_cli.match(corridor, 100, 104).pose, atol=0.02)
    joint, _ = nscan_cli.nscan(corridor, [100, 104], initial=np.array([[0, 0, 0], pair.pose]))
    assert joint is not None
    np.testing.assert_allclose(joint.poses[1] - joint.poses[0], pair.pose, atol=0.02)


def test_a_log_without_odometry_needs_none():
    log = nscan_cli.read_log(CORRIDOR_LOG, nscan_cli.ReadingOptions(odometry=False))
    assert nscan_cli.match(log, 100, 101).converged
    assert nscan_cli.nscan(log, [100, 101, 102])[0] is not None


def test_a_grid_needs_the_log_of_the_graph(corridor):
    graph = nscan_cli.build_graph(corridor)
    part = nscan_cli.read_log("robot.log.gz", nscan_cli.ReadingOptions(every=2))
    with pytest.raises(WrongUsageError, match="lacks scans of the graph; read the log"):
        nscan_cli.make_grid(part, graph)
