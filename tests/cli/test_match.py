"""`nscan-cli match` as a user meets it."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

import numpy as np
import pytest
from PIL import Image

from nscan_cli.cli.main import run
from nscan_cli.cli.match import with_defaults
from nscan_cli.errors import WrongUsageError
from nscan_cli.graph.io.symmetric_matrices import from_upper_triangle
from nscan_cli.logs.load import read_log
from nscan_cli.mapping.figures.canvas import BLUE, PURPLE, VERMILLION
from nscan_cli.poses import relative
from tests.cli.documents import assert_error_line, document_and_notices
from tests.data import CORRIDOR_LOG, OFFICE_LOG, data_file
from tests.logs.lines import flaser
from tests.simulation import odometry_faults

KEYS = [
    "format", "version", "units", "provenance", "reference", "scan", "initial", "pose", "energy",
    "gradient_norm", "decrement", "hessian", "covariance", "eigenvalues", "weakest", "overlap", "iterations",
    "evaluations", "unsettled_stages", "converged", "reason",
]  # fmt: skip


matched = partial(document_and_notices, "match")


def off(document: dict[str, Any], log: str) -> np.ndarray:
    """The error (3,) of the pose against the truth in the log."""
    truth = read_log(log).truth
    assert truth is not None
    step = relative(truth[document["scan"]], truth[document["reference"]])
    error: np.ndarray = relative(np.array(document["pose"]), step)
    return error


def test_the_document(capsys):
    document, said = matched(capsys, OFFICE_LOG, "--reference", "300", "--scan", "306")
    assert list(document) == KEYS
    assert (document["format"], document["version"]) == ("nscan-match", "1.0")
    assert document["units"] == {"length": "m", "angle": "rad"}
    log = read_log(OFFICE_LOG)
    source = {"name": "office.log.gz", "sha256": log.source.sha256, "bytes": log.source.bytes}
    assert document["provenance"]["inputs"] == [source]
    assert document["provenance"]["parameters"]["prior"] == "odometry"
    assert log.odometry is not None
    np.testing.assert_allclose(document["initial"], relative(log.odometry[306], log.odometry[300]), atol=1e-8)
    assert np.hypot(*off(document, OFFICE_LOG)[:2]) < 0.03
    assert abs(off(document, OFFICE_LOG)[2]) < 0.01
    hessian, covariance = (from_upper_triangle(document[key], 3) for key in ("hessian", "covariance"))
    np.testing.assert_allclose(hessian @ covariance, np.eye(3), atol=0.01)
    np.testing.assert_allclose(np.linalg.eigvalsh(hessian), document["eigenvalues"], rtol=1e-3)
    assert document["weakest"]["sigma"] ** 2 <= np.trace(covariance[:2, :2]) * 1.001
    assert document["energy"] < -50
    assert 0.5 < document["overlap"] <= 1
    assert (document["converged"], document["reason"]) == (True, None)
    assert document["evaluations"] > document["iterations"] > 0
    titles = [line.split()[0] for line in said]
    assert titles == ["scan", "pose", "sigma", "weakest", "overlap", "match"]
    assert max(map(len, said)) <= 80
    assert said[0] == "scan     306 in the frame of scan 300"
    sigmas = np.sqrt(np.diag(covariance)) * (1, 1, 180 / np.pi)
    told = [float(value) for value in re.findall(r"[\d.]+", said[2])]
    np.testing.assert_allclose(told, sigmas, rtol=0.1, atol=0.005)
    assert "converged" in said[-1]


def test_a_corridor_shows_as_the_weakest_direction(capsys):
    """Scans 45 and 117 are 1 and 2 of the paper's Fig. 3: open along the corridor, the x axis of 45."""
    document, said = matched(capsys, CORRIDOR_LOG, "--reference", "45", "--scan", "117", "--prior", "none")
    assert abs(np.degrees(document["weakest"]["direction"])) < 10
    across = 1 / np.sqrt(document["eigenvalues"][-1])
    assert document["weakest"]["sigma"] is None or document["weakest"]["sigma"] > 20 * across
    assert said[3].startswith("weakest")
    assert "from scan 45's x axis" in said[3]


def test_the_start_can_be_given(capsys):
    near, _ = matched(capsys, OFFICE_LOG, "--reference", "300", "--scan", "306", "--prior", "none")
    x, y, angle = near["pose"]
    initial = f"{x + 0.05:.4f},{y - 0.05:.4f},{np.degrees(angle) + 1:.4f}"
    given, _ = matched(
        capsys, OFFICE_LOG, "--reference", "300", "--scan", "306", "--prior", "none", "--initial", initial
    )
    np.testing.assert_allclose(given["initial"], [x + 0.05, y - 0.05, angle + np.radians(1)], atol=1e-4)
    np.testing.assert_allclose(given["pose"], near["pose"], atol=0.005)
    still, _ = matched(capsys, OFFICE_LOG, "--reference", "300", "--scan", "306", "--initial", "identity")
    assert still["initial"] == [0, 0, 0]


def test_no_overlap_is_a_result_that_says_so(capsys):
    document, said = matched(
        capsys, OFFICE_LOG, "--reference", "0", "--scan", "1", "--initial", "-300,0,0", "--prior", "none"
    )
    assert (document["converged"], document["reason"]) == (False, "no overlap")
    assert document["covariance"] is None
    assert document["weakest"]["sigma"] is None
    assert said[2] == "sigma    unknown"
    assert "not converged (no overlap)" in said[-1]


def test_the_file_holds_what_standard_output_would(tmp_path, capsys):
    arguments = ["match", OFFICE_LOG, "--reference", "10", "--scan", "12"]
    assert run(arguments) == 0
    out = capsys.readouterr().out
    assert run([*arguments, "-o", str(tmp_path / "match.json"), "-q"]) == 0
    assert (tmp_path / "match.json").read_text() == out
    assert capsys.readouterr() == ("", "")
    assert all(line.count('":') >= 1 for line in out.splitlines())


def test_without_odometry_it_starts_from_identity_and_says_so(capsys):
    document, said = matched(capsys, OFFICE_LOG, "--reference", "10", "--scan", "12", "--no-odometry")
    assert document["initial"] == [0, 0, 0]
    assert document["provenance"]["parameters"]["prior"] == "none"
    assert said[0] == "no odometry: initial identity, prior none"
    _, said = matched(
        capsys, OFFICE_LOG, "--reference", "10", "--scan", "12", "--no-odometry", "--initial", "identity",
        "--prior", "none",
    )  # fmt: skip
    assert "no odometry" not in said[0]


def test_the_options_can_be_dumped_and_read_back(tmp_path, capsys):
    arguments = ["match", OFFICE_LOG, "--reference", "10", "--scan", "12", "--initial", "0.1,0,90"]
    assert run([*arguments, "--dump-config"]) == 0
    config = tmp_path / "match.toml"
    config.write_text(capsys.readouterr().out)
    assert 'initial = "0.1,0,90"' in config.read_text()
    document, _ = matched(capsys, OFFICE_LOG, "--config", str(config))
    np.testing.assert_allclose(document["initial"], [0.1, 0, np.pi / 2], atol=1e-9)


def test_the_plot_shows_both_scans_before_and_after(tmp_path, capsys):
    arguments = ["match", OFFICE_LOG, "--reference", "2000", "--scan", "2008", "--initial", "0.6,0.4,12"]
    assert run(arguments) == 0
    alone = capsys.readouterr()
    assert run([*arguments, "--plot", str(tmp_path / "match.png")]) == 0
    assert capsys.readouterr() == alone
    assert [path.name for path in tmp_path.iterdir()] == ["match.png"]
    with Image.open(tmp_path / "match.png") as picture:
        assert picture.format == "PNG"
        pixels = np.asarray(picture).astype(int)
    # Scans of a room, no wider than high: two panels side by side.
    height, width, _channels = pixels.shape
    assert 2000 < width < 3000
    assert height < width
    before, after = pixels[:, : width // 2], pixels[:, width // 2 :]
    assert (before != after).any()
    for panel in (before, after):
        for colour in (BLUE, VERMILLION):
            assert np.count_nonzero((panel == colour).all(axis=-1)) > 100
    purple = [np.count_nonzero(np.abs(panel - PURPLE).max(axis=-1) < 40) for panel in (before, after)]
    assert purple[0] == 0
    assert purple[1] > 100


def test_a_match_that_failed_has_a_plot_too(tmp_path, capsys):
    document, _ = matched(
        capsys, OFFICE_LOG, "--reference", "0", "--scan", "1", "--initial", "-300,0,0", "--prior", "none",
        "--plot", str(tmp_path / "failed.png"),
    )  # fmt: skip
    assert not document["converged"]
    assert (tmp_path / "failed.png").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--plot", "-"], 2, "--plot -: only the result can go to standard output; name a file"),
        (["--plot", "match.pdf"], 2, "pictures are PNG; name it like match.png"),
        (["-o", "match", "--plot", "./match"], 2, "--plot ./match: is another file of this command"),
        (["--plot", OFFICE_LOG], 2, "is another file of this command"),
        (["--plot", "no/such.png"], 73, "the folder no does not exist"),
        (["--plot", "."], 73, "is a folder"),
    ],
)
def test_a_plot_that_cannot_be_is_refused_before_the_work(
    tmp_path, monkeypatch, capsys, arguments, code, said
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("nscan_cli.logs.load.read_log", pytest.fail)
    assert run(["match", OFFICE_LOG, "--reference", "10", "--scan", "12", *arguments]) == code
    assert_error_line(capsys, said)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--reference", "0"], 2, "--scan"),
        (["--reference", "0", "--scan", "9999"], 2, "no scan 9999; scans read go from 0 to 2519"),
        (["--reference", "0", "--scan", "-1"], 2, "--scan"),
        (["--reference", "0", "--scan", "3", "--every", "2"], 2, "no scan 3"),
        (["--reference", "0", "--scan", "1", "--initial", "1,2"], 2, "X,Y,DEG"),
        (["--reference", "0", "--scan", "1", "--initial", "1,nan,2"], 2, "not finite"),
        (["--reference", "0", "--scan", "1", "--prior", "graph"], 2, "--prior"),
        (
            ["--reference", "0", "--scan", "1", "--no-odometry", "--initial", "odometry"],
            2,
            "--initial identity",
        ),
        (["--reference", "0", "--scan", "1", "--no-odometry", "--prior", "odometry"], 2, "--prior none"),
        (["--reference", "0", "--scan", "1", "--max-range", "0.4"], 65, "scan 0 has 0 usable beams"),
        (["--reference", "0", "--scan", "1", "-o", "no/such/folder.json"], 73, "does not exist"),
    ],
)
def test_mistakes_are_one_line(tmp_path, monkeypatch, capsys, arguments, code, said):
    monkeypatch.chdir(tmp_path)
    assert run(["match", OFFICE_LOG, *arguments]) == code
    assert_error_line(capsys, said)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_log_and_one_that_is_none(tmp_path, capsys):
    (tmp_path / "text.log").write_text("no log\n")
    arguments = ["--reference", "0", "--scan", "1"]
    assert run(["match", str(tmp_path / "none.log"), *arguments]) == 66
    assert run(["match", str(tmp_path / "text.log"), *arguments]) == 65
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_a_scan_of_two_beams_is_bad_data(tmp_path, capsys):
    path = tmp_path / "few.log"
    path.write_text(f"{flaser(1, (1, 2))}\n{flaser(2, (1, 2))}\n")
    assert run(["match", str(path), "--reference", "0", "--scan", "1"]) == 65
    assert "few.log: scan 0 has 2 usable beams" in capsys.readouterr().err


@pytest.mark.logs
def test_a_real_log(capsys):
    """Intel, scans 2 s apart: the odometry is near, and most of the points lie on the walls of both."""
    log = str(data_file("intel.log.gz"))
    document, _ = matched(capsys, log, "--reference", "3000", "--scan", "3010")
    assert document["converged"]
    assert document["overlap"] > 0.7
    assert document["weakest"]["sigma"] < 0.1
    np.testing.assert_allclose(document["pose"][:2], document["initial"][:2], atol=0.15)


def test_a_stage_that_was_cut_off_is_told_though_the_match_has_converged(capsys):
    """Half a metre off by the truth: the place is a minimum, but the way there was cut at 50 iterations."""
    arguments = ["--reference", "553", "--scan", "567", "--initial=-0.4,0.1,155", "--prior", "none"]
    document, said = matched(capsys, OFFICE_LOG, *arguments)
    assert np.hypot(*off(document, OFFICE_LOG)[:2]) > 0.4
    assert (document["converged"], document["reason"], document["unsettled_stages"]) == (True, None, 1)
    assert said[-1].strip() == "1 stage before the last did not converge: the result is less certain"


def test_scans_whose_odometry_is_missing_start_from_identity(capsys):
    log = odometry_faults.missing(read_log(OFFICE_LOG), slice(12, 13))
    assert with_defaults(log, (10, 11), None, None, quiet=False) == ("odometry", "odometry")
    assert with_defaults(log, (10, 12), None, None, quiet=False) == ("identity", "none")
    assert capsys.readouterr().err == "no odometry at scan 12: initial identity, prior none\n"
    with pytest.raises(WrongUsageError, match="no odometry at scan 12; give --prior none"):
        with_defaults(log, (10, 12), None, "odometry", quiet=False)
