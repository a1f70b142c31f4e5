"""`nscan-cli render` of other mappers' results: trajectories and g2o with a log; two results compared."""

from __future__ import annotations

import re

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.poses import compose
from tests.cli.test_render import POSES, graph_of, log_text, picture, room

__all__ = ["room"]
STAMPS = [f"{10 + k}.02" for k in range(len(POSES))]
"""Those of another mapper, 20 ms after those of the log."""


@pytest.fixture
def results(room):
    """The room's graph as a trajectory and as g2o, and a trajectory that is moved, with a pose 0.5 m off."""
    (room / "other.tum").write_bytes(write_tum(STAMPS, POSES))
    (room / "other.g2o").write_bytes(write_g2o(graph_of(log_text())))
    wrong = POSES + np.array([[0.0, 0, 0], [0, 0, 0], [0, 0.5, 0], [0, 0, 0], [0, 0, 0]])
    moved = compose(np.broadcast_to([7.0, -3.0, 1.0], POSES.shape), wrong)
    (room / "wrong.tum").write_bytes(write_tum(STAMPS, moved))
    return room


@pytest.mark.parametrize("result", ["other.tum", "other.g2o"])
def test_the_map_of_a_result_is_that_of_the_graph(results, result, capsys):
    assert run(["render", "room.json", "-o", "ours.png"]) == 0
    assert run(["render", result, "room.log", "-o", "theirs.png"]) == 0
    assert (results / "theirs.png").read_bytes() == (results / "ours.png").read_bytes()
    assert (results / "theirs.yaml").is_file()
    told = "other.g2o: its vertices are taken as numbers of scans of room.log" in capsys.readouterr().err
    assert told == result.endswith(".g2o")


def test_a_page_of_a_trajectory(results):
    assert run(["render", "other.tum", "room.log", "-o", "theirs.html"]) == 0
    assert (results / "theirs.html").stat().st_size > 10_000


def test_a_shorter_trajectory_draws_its_scans_alone(results, capsys):
    (results / "short.tum").write_bytes(write_tum(STAMPS[1:3], POSES[1:3]))
    assert run(["render", "short.tum", "room.log", "-o", "theirs.png"]) == 0
    assert "from 2 scans" in capsys.readouterr().err


def test_vertices_that_count_keyframes_are_matched_in_order(results, capsys):
    """As other mappers number them; as numbers of scans they would be compared with the wrong ones."""
    log = log_text()
    graph = graph_of(log, anchors=np.array([0, 0, 2, 2, 4]), pairwise=[])
    (results / "few.json").write_bytes(write_graph(graph))
    kept = POSES[[0, 2, 4]]
    (results / "counted.g2o").write_bytes(
        write_g2o(
            graph_of(
                log, scans=np.arange(3), stamps=STAMPS[:3], poses=kept, anchors=np.arange(3), pairwise=[]
            )
        )
    )
    assert run(["render", "few.json", "counted.g2o", "room.log", "-o", "same.png", "--compare"]) == 0
    said = capsys.readouterr().err
    assert "counted.g2o: its vertices are taken as the keyframes of few.json (3), in order" in said
    assert "numbers of scans" not in said
    assert "off few.json by 0.000 m (RMS), at most 0.000 m at scan 0, in 3 common scans" in said
    assert run(["render", "counted.g2o", "few.json", "room.log", "-o", "same.png", "--compare"]) == 0
    (results / "fewer.json").write_bytes(
        write_graph(graph_of(log, anchors=np.array([0, 0, 0, 0, 4]), pairwise=[]))
    )
    assert run(["render", "fewer.json", "counted.g2o", "room.log", "-o", "off.png", "--compare"]) == 65
    assert "neither the scans of fewer.json (5) nor its keyframes (2)" in capsys.readouterr().err


def coloured(pixels: np.ndarray, blue: bool) -> int:
    red, _green, of_blue = (pixels[..., channel].astype(int) for channel in range(3))
    return int(((of_blue - red if blue else red - of_blue) > 100).sum())


def test_two_results_over_each_other(results, capsys):
    assert run(["render", "room.json", "other.tum", "room.log", "-o", "same.png", "--compare"]) == 0
    said = capsys.readouterr().err
    assert "same.png: other.tum is off room.json by 0.000 m (RMS), at most 0.000 m" in said
    assert "in 5 common scans" in said
    assert run(["render", "room.json", "wrong.tum", "-o", "off.png", "--compare"]) == 0
    told = re.search(r"by ([\d.]+) m \(RMS\), at most ([\d.]+) m at scan (\d+)", capsys.readouterr().err)
    assert told
    assert 0.15 < float(told[1]) < 0.25
    assert 0.3 < float(told[2]) < 0.5
    assert told[3] == "2"
    assert not (results / "off.yaml").exists()
    same, off = picture(results / "same.png"), picture(results / "off.png")
    # Walls of one result alone are in its colour.
    assert coloured(off, blue=True) > 1.5 * coloured(same, blue=True)
    assert coloured(off, blue=False) > 1.5 * coloured(same, blue=False) > 100


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["other.tum"], 66, "other.tum: a trajectory does not name its log; give its path as LOG"),
        (["early.tum", "room.log"], 65, "no stamp of room.log lies within 0.1 s of it"),
        (["room.log", "room.log"], 65, "room.log"),
        (["room.json", "--compare"], 2, "--compare needs two results: render A.json B.tum LOG --compare"),
        (["other.tum", "room.json", "--compare"], 66, "other.tum: a trajectory does not name its log"),
        (
            ["room.json", "other.tum", "--compare", "--clean"],
            2,
            "--compare draws one picture of both results",
        ),
        (
            ["room.json", "other.tum", "--compare", "--graph"],
            2,
            "--compare draws one picture of both results",
        ),
        (["room.json", "other.tum", "--compare", "--yaml"], 2, "--yaml is for plain maps"),
        (["room.json", "-", "--compare"], 2, "--compare reads files"),
        (["room.json", "room.log", "--compare"], 65, "room.log"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(results, capsys, arguments, code, said):
    (results / "early.tum").write_bytes(write_tum(["1.0", "2.0"], POSES[:2]))
    assert run(["render", *arguments, "-o", "map.png"]) == code
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (results / "map.png").exists()


def test_a_comparison_replaces_no_input(results, capsys):
    before = (results / "other.tum").read_bytes()
    assert run(["render", "room.json", "other.tum", "room.log", "-o", "other.tum", "--compare"]) == 2
    assert "other.tum" in capsys.readouterr().err
    assert (results / "other.tum").read_bytes() == before
