from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from nscan_cli.cli.main import run
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.mapping.figures.canvas import BLUE, VERMILLION
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.mapping.figures.error_plots import REFERENCE_COLOUR
from tests.cli.documents import assert_error_line
from tests.mapping.figures.pixels import count

# The robot drives 1 m a second along x; the relations say 1.1 m, and 1 m with 2° more.
STAMPS = ["10.000000", "11.000000", "12.000000", "13.000000"]
POSES = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
RELATIONS = f"10 11 1.1 0 0 0 0 0\n11 12 1 0 0 0 0 {np.radians(2)}\n12 99 1 0 0 0 0 0\n"


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("result.tum").write_bytes(write_tum(STAMPS, POSES))
    Path("floor.relations").write_text(RELATIONS)
    aside = POSES + np.array([[0, 0.1, 0], [0, -0.1, 0], [0, -0.1, 0], [0, 0.1, 0]])
    Path("reference.tum").write_bytes(write_tum(STAMPS, aside))
    return tmp_path


def test_relations_give_this_table(files: Path, capsys: pytest.CaptureFixture[str]):
    assert run(["evaluate", "result.tum", "--relations", "floor.relations", "--worst", "1"]) == 0
    out, err = capsys.readouterr()
    assert out == (
        "result     result.tum: 4 poses\n"
        "\n"
        "relations  floor.relations: 2 of 3 used, 2 at exact stamps,\n"
        "           0 within 0.1 s; 1 not used, because no pose is near\n"
        "\n"
        "                        mean        sd    median mean square      rmse       max\n"
        "translation, m        0.0500    0.0707    0.0500       0.005    0.0707    0.1000\n"
        "rotation, deg         1.0000    1.4142    1.0000           2    1.4142    2.0000\n"
        "\n"
        "worst relations     line                from                  to        m    deg\n"
        "                       1                  10                  11    0.100    0.0\n"
    )
    assert max(len(line) for line in out.splitlines()) <= 80
    assert err == "warning: a stamp is far from every pose in 1 of 3 relations\n"


def test_quiet_silences_the_warning(files: Path, capsys: pytest.CaptureFixture[str]):
    assert run(["evaluate", "result.tum", "--relations", "floor.relations", "-q"]) == 0
    assert capsys.readouterr().err == ""


def test_json_has_the_same_figures(files: Path, capsys: pytest.CaptureFixture[str]):
    arguments = ["evaluate", "result.tum", "--relations", "floor.relations", "--reference", "reference.tum"]
    assert run([*arguments, "--worst", "5", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    relations, reference = document["relations"], document["reference"]
    assert {key: relations[key] for key in ("count", "used", "exact", "near", "too_far")} == {
        "count": 3,
        "used": 2,
        "exact": 2,
        "near": 0,
        "too_far": 1,
    }
    assert relations["translation"]["mean"] == pytest.approx(0.05)
    assert relations["rotation"]["max"] == pytest.approx(2)
    assert [row["line"] for row in relations["worst"]] == [1, 2]
    assert relations["worst"][0]["stamps"] == ["10", "11"]
    # All four are 0.1 m aside, in turn: the best alignment is none.
    assert reference["matched"] == 4
    assert reference["ate"]["translation"]["rmse"] == pytest.approx(0.1)
    # The motion over the reference's path is 0.2 m aside for the first and last metre, 0 for the second.
    assert reference["rpe"]["translation"]["mean"] == pytest.approx(0.4 / 3)


def test_a_reference_gives_ate_and_rpe(files: Path, capsys: pytest.CaptureFixture[str]):
    assert run(["evaluate", "result.tum", "--reference", "reference.tum"]) == 0
    out = capsys.readouterr().out
    assert "reference  reference.tum: 4 poses match within 0.1 s, 0 do not" in out
    row = next(line for line in out.splitlines() if line.startswith("ATE, m"))
    assert row.split()[2:] == ["0.1000", "0.0000", "0.1000", "0.01", "0.1000", "0.1000"]


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (["--relations", "floor.relations", "--max-translation", "0.051"], 0),
        (["--relations", "floor.relations", "--max-translation", "0.049"], 3),
        (["--relations", "floor.relations", "--max-rotation", "1.01"], 0),
        (["--relations", "floor.relations", "--max-rotation", "0.99"], 3),
        (["--reference", "reference.tum", "--max-translation", "0.101"], 0),
        (["--reference", "reference.tum", "--max-translation", "0.099"], 3),
    ],
)
def test_a_limit_that_is_exceeded_is_exit_3_after_the_table(
    files: Path, capsys: pytest.CaptureFixture[str], options: list[str], code: int
):
    assert run(["evaluate", "result.tum", "-q", *options]) == code
    out, err = capsys.readouterr()
    assert "mean square" in out
    assert (" is above " in err) == (code == 3)
    assert len(err.splitlines()) == (code == 3)


def test_the_result_may_come_from_standard_input(
    files: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    data = Path("result.tum").read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    assert run(["evaluate", "-", "--relations", "floor.relations", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["result"] == "standard input"


@pytest.mark.parametrize(
    ("arguments", "code", "problem"),
    [
        (["result.tum"], 2, "there is no reference; give --relations or --reference"),
        (["-", "--relations", "-"], 2, "standard input (-) can be one input only"),
        (["nowhere.json", "--relations", "floor.relations"], 66, "nowhere.json: no such file"),
        (["result.tum", "--relations", "nowhere"], 66, "nowhere: no such file"),
        (["result.tum", "--relations", "."], 66, ".: is a folder"),
        (["result.tum", "--relations", "result.tum"], 65, "no stamp of result.tum lies within 0.1 s"),
        (["floor.relations", "--reference", "result.tum"], 65, "floor.relations, line 1: the quaternion"),
    ],
)
def test_a_mistake_is_one_line_and_its_code(
    files: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, problem: str
):
    assert run(["evaluate", *arguments]) == code
    assert_error_line(capsys, problem)


def plotted(capsys: pytest.CaptureFixture[str], *arguments: str) -> np.ndarray:
    """The pixels of the picture; the tables are the same as without it."""
    assert run(["evaluate", "result.tum", *arguments]) == 0
    alone = capsys.readouterr()
    assert run(["evaluate", "result.tum", *arguments, "--plot", "errors.png"]) == 0
    assert capsys.readouterr() == alone
    with Image.open("errors.png") as picture:
        assert picture.format == "PNG"
        pixels: np.ndarray = np.asarray(picture).astype(int)
    return pixels


def test_the_plot_shows_the_worst_relations(files: Path, capsys: pytest.CaptureFixture[str]):
    relations = ("--relations", "floor.relations")
    both, one, none = (
        plotted(capsys, *relations, *worst) for worst in ((), ("--worst", "1"), ("--worst", "0"))
    )
    assert both.shape == one.shape
    assert 2000 < both.shape[1] < 3500
    assert count(both, BLUE) > 500
    # The path is 3 m of nearly 2400 pixels, a relation 1 m of it: a line of 7 pixels and a number more.
    assert count(both, VERMILLION) - count(one, VERMILLION) > 3000
    assert count(none, VERMILLION) == 0


def test_the_plot_shows_both_trajectories_and_the_error(files: Path, capsys: pytest.CaptureFixture[str]):
    pixels = plotted(capsys, "--reference", "reference.tum")
    assert count(pixels, REFERENCE_COLOUR) > 1000
    # All errors are 0.1 m, the greatest.
    assert count(pixels, plasma(16)[-1]) > 100


@pytest.mark.parametrize("square", [True, False], ids=["side by side", "stacked"])
def test_relations_and_reference_have_a_panel_each(
    files: Path, capsys: pytest.CaptureFixture[str], square: bool
):
    if square:
        poses = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        for name in ("result.tum", "reference.tum"):
            Path(name).write_bytes(write_tum(STAMPS, poses))
    pixels = plotted(capsys, "--relations", "floor.relations", "--reference", "reference.tum")
    height, width, _channels = pixels.shape
    if square:
        first, second = pixels[:, : width // 2], pixels[:, width // 2 :]
    else:
        first, second = pixels[: height // 2], pixels[height // 2 :]
    assert count(first, VERMILLION) > 500
    assert count(second, REFERENCE_COLOUR) > 500
    # A few pixels of the edges of letters have that gray as well.
    assert count(first, REFERENCE_COLOUR) < 100
    assert count(second, VERMILLION) == 0


def test_a_failed_check_has_a_plot_too(files: Path, capsys: pytest.CaptureFixture[str]):
    arguments = ["--relations", "floor.relations", "--max-translation", "0", "--plot", "errors.png"]
    assert run(["evaluate", "result.tum", *arguments]) == 3
    assert Path("errors.png").exists()


@pytest.mark.parametrize(
    ("plot", "code", "problem"),
    [
        ("-", 2, "--plot -: only the result can go to standard output"),
        ("errors.jpg", 2, "pictures are PNG; name it like errors.png"),
        ("result.tum", 2, "is another file of this command"),
        ("./floor.relations", 2, "is another file of this command"),
        ("no/errors.png", 73, "the folder no does not exist"),
    ],
)
def test_a_plot_that_cannot_be_is_refused_before_the_work(
    files: Path, capsys: pytest.CaptureFixture[str], plot: str, code: int, problem: str
):
    before = {path: path.read_bytes() for path in files.iterdir()}
    assert run(["evaluate", "result.tum", "--relations", "floor.relations", "--plot", plot]) == code
    assert_error_line(capsys, problem)
    assert {path: path.read_bytes() for path in files.iterdir()} == before
