"""Pictures for people say how large they are to be printed; a map for robots holds nothing but its cells."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from PIL import Image

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import write_graph
from tests.cli.room_logs import room_log
from tests.cli.test_render import graph_of, log_text


def chunks(png: bytes) -> list[str]:
    """The names of a PNG's chunks, in order."""
    found, at = [], 8
    while at < len(png):
        (length,) = struct.unpack_from(">I", png, at)
        found.append(png[at + 4 : at + 8].decode())
        at += 12 + length
    return found


def dots_an_inch(png: bytes) -> float:
    """By the chunk pHYs (PNG, 11.3.4.3): dots a metre across and up, and 1 for the metre."""
    at = png.index(b"pHYs") + 4
    across, up, unit = struct.unpack_from(">IIB", png, at)
    assert (across, unit) == (up, 1)
    return float(across * 0.0254)


@pytest.fixture
def room(folder: Path) -> Path:
    """The current folder, with room.log and its graph room.json."""
    (folder / "room.log").write_bytes(log_text())
    (folder / "room.json").write_bytes(write_graph(graph_of(log_text())))
    return folder


@pytest.mark.parametrize("options", [["--style", "paper"], ["--trajectory"]], ids=["paper", "over the map"])
def test_a_figure_is_20_cm_long_in_print(room, options):
    assert run(["render", "room.json", "-o", "figure.png", *options, "-q"]) == 0
    data = (room / "figure.png").read_bytes()
    assert dots_an_inch(data) == pytest.approx(300, abs=0.01)
    if "paper" in options:
        with Image.open(room / "figure.png") as picture:
            # 20 cm and the margins beside and above the axes.
            assert 20 < max(picture.size) / 300 * 2.54 < 23


def test_plots_are_figures_too(folder):
    (folder / "room.log").write_text(room_log(3))
    match = ["match", "room.log", "--reference", "0", "--scan", "1", "-o", "match.json", "-q"]
    assert run([*match, "--plot", "match.png"]) == 0
    assert run(["nscan", "room.log", "--scans", "0-2", "-o", "n.json", "-q", "--plot", "n.png"]) == 0
    for name in ("match.png", "n.png"):
        assert dots_an_inch((folder / name).read_bytes()) == pytest.approx(300, abs=0.01)


def test_a_map_for_robots_is_its_cells_alone(room):
    assert run(["render", "room.json", "-o", "map.png", "-q"]) == 0
    assert chunks((room / "map.png").read_bytes()) == ["IHDR", "IDAT", "IEND"]
