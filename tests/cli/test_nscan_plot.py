"""`nscan-cli nscan --plot`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.model import Pairwise
from nscan_cli.logs.load import read_log
from nscan_cli.mapping.figures.canvas import BLACK, GRAY
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.poses import relative
from tests.cli.documents import assert_error_line
from tests.cli.test_nscan import SCANS, SPEC, graph_of, matched
from tests.data import OFFICE_LOG
from tests.mapping.figures.pixels import count


def test_the_plot_shows_the_start_above_the_result(tmp_path, capsys):
    arguments = [OFFICE_LOG, "--scans", SPEC]
    alone, _ = matched(capsys, *arguments)
    beside, said = matched(capsys, *arguments, "--plot", str(tmp_path / "nscan.png"))
    assert beside == alone
    assert len(said) == 3
    with Image.open(tmp_path / "nscan.png") as picture:
        assert picture.format == "PNG"
        pixels = np.asarray(picture).astype(int)
    height, width, _channels = pixels.shape
    assert 1500 < width < 3000
    above, below = pixels[: height // 2], pixels[height // 2 :]
    assert above.shape == below.shape
    # One circle for each scan in either, apart from the legend's; and they have moved.
    for panel in (above, below):
        assert all(count(panel, colour) > 200 for colour in plasma(4))
    assert (above != below).any()


def test_the_plot_marks_the_scans_that_were_left_out(tmp_path, capsys):
    """A graph puts scan 2008 1 m aside, within 0.2 m: where it fits is out of these bounds."""
    graph = graph_of(read_log(OFFICE_LOG), SCANS)
    graph.poses[1, 1] += 1.0
    for a, b in ((0, 1), (1, 2), (1, 3), (0, 2), (2, 3)):
        step = relative(graph.poses[b], graph.poses[a])
        graph.pairwise.append(Pairwise((a, b), step, np.eye(3) * 25, "track"))
    path = str(tmp_path / "torn.json")
    Path(path).write_bytes(write_graph(graph))
    document, _ = matched(
        capsys, OFFICE_LOG, "--scans", SPEC, "--initial", path, "--prior", path,
        "--plot", str(tmp_path / "nscan.png"),
    )  # fmt: skip
    assert [out["scan"] for out in document["left_out"]] == [2008]
    with Image.open(tmp_path / "nscan.png") as picture:
        pixels = np.asarray(picture).astype(int)
    above, below = pixels[: len(pixels) // 2], pixels[len(pixels) // 2 :]
    gray = [255 + (channel - 255) * 170 // 255 for channel in GRAY]
    gray_dots = [
        np.count_nonzero(np.abs(panel - np.array(gray)).max(axis=-1) <= 2) for panel in (above, below)
    ]
    # Dots that no other scan covers; in the panel below, edges of letters only.
    assert gray_dots[0] > 500 + gray_dots[1]
    # The cross, in the middle of the panel; beside it only the axes and what is written have black.
    middles = [panel[150:-250, 200:-100] for panel in (above, below)]
    assert [count(middle, BLACK) > 50 for middle in middles] == [True, False]


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--plot", "-"], 2, "--plot -: only the result can go to standard output"),
        (["--plot", "nscan.svg"], 2, "pictures are PNG"),
        (["-o", "nscan.png", "--plot", "nscan.png"], 2, "nscan.png: has the name of a picture"),
        (["--plot", OFFICE_LOG], 2, "is another file of this command"),
        (["--initial", "start.tum", "--plot", "start.tum"], 2, "is another file of this command"),
        (["--plot", "no/such.png"], 73, "the folder no does not exist"),
    ],
)
def test_a_plot_that_cannot_be_is_refused_before_the_work(
    tmp_path, monkeypatch, capsys, arguments, code, said
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("nscan_cli.logs.load.read_log", pytest.fail)
    assert run(["nscan", OFFICE_LOG, "--scans", "1,2", *arguments]) == code
    assert_error_line(capsys, said)
    assert list(tmp_path.iterdir()) == []
