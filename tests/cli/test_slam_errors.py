"""What `nscan-cli slam` says of a user's mistakes."""

from __future__ import annotations

import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.warm_up import side_by_side
from tests.cli.documents import assert_error_line
from tests.cli.room_logs import ALL_OUTPUTS, room_log
from tests.graph.small_graph import small_graph

PNG = b"\x89PNG\r\n\x1a\n" + bytes(40)


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["none.log"], 66, "none.log: no such file"),
        (["folder"], 66, "folder: is a folder"),
        (["empty.log"], 65, "empty.log: is empty"),
        (["picture.log"], 65, "picture.log: is a PNG"),
        (["wheels.log"], 65, "wheels.log: has no laser scans, only ODOM"),
        (["good.log", "--laser", "RLASER"], 2, "has no RLASER scans"),
        (["good.log", "--start", "1e6"], 2, "--start"),
        (["good.log", "--max-scans", "2"], 2, "--max-scans"),
        (["good.log", "--relations", "some"], 2, "--relations"),
        ([], 2, "slam: give LOG, or --from GRAPH"),
        (["--from", "none.json"], 66, "none.json: no such file"),
        (["--from", "graph.json"], 2, "graph.json was not made from a log by slam; leave out LOG"),
        (["-", "--from", "-"], 2, "standard input (-) can be one input only"),
        (["good.log", "-o", "none/out.json"], 73, "none/out.json: the folder none does not exist"),
        (["good.log", "--map", "none/out.png"], 73, "none/out.png: the folder none does not exist"),
        (["good.log", "--trajectory", "none/out.tum"], 73, "none/out.tum: the folder none"),
        (["good.log", "--g2o", "folder"], 73, "folder: is a folder"),
        (["good.log", "--carmen", "none/out.log"], 73, "none/out.log: the folder none does not exist"),
        (["good.log", "--carmen", "good.log"], 2, "good.log is both an input and an output"),
        (["good.log", "--carmen", "out.json"], 2, "two outputs have the same name"),
        (["good.log", "--depfile", "none/out.d"], 73, "none/out.d: the folder none does not exist"),
        (["good.log", "--map", "out.yaml"], 2, "out.yaml: maps are PNG or PGM; name it like out.png"),
        (["good.log", "--map", "out.JPG"], 2, "out.JPG: maps are PNG or PGM; name it like out.png"),
        (
            ["good.log", "-o", "q.png"],
            2,
            "q.png: has the name of a picture, but is the graph in JSON; give -o",
        ),
        (["good.log", "-o", "q.HTML"], 2, "q.HTML: has the name of a picture, but is the graph in JSON"),
        (["good.log", "--map", "-"], 2, "only the graph (-o) can go to standard output"),
        (["good.log", "--trajectory", "-"], 2, "only the graph (-o) can go to standard output"),
        (["good.log", "--config", "none.toml"], 66, "none.toml"),
        (["good.log", "--config", "wrong.toml"], 65, "slam has no option 'max_scans'"),
    ],
)
def test_mistakes_are_one_line_and_leave_nothing_behind(folder, capsys, arguments, code, said):
    (folder / "folder").mkdir()
    (folder / "empty.log").write_bytes(b"")
    (folder / "picture.log").write_bytes(PNG)
    (folder / "wheels.log").write_text("ODOM 0 0 0 0 0 0 1.0 nohost 1.0\n" * 3)
    (folder / "good.log").write_text(room_log(5))
    (folder / "graph.json").write_bytes(write_graph(small_graph()))
    (folder / "wrong.toml").write_text("[slam]\nmax_scans = 3\n")
    before = sorted(path.name for path in folder.rglob("*"))
    assert run(["slam", *ALL_OUTPUTS, *arguments]) == code
    assert_error_line(capsys, said)
    assert sorted(path.name for path in folder.rglob("*")) == before


def test_a_log_that_cannot_be_read_is_told_before_kernels_are_compiled(folder, capsys, monkeypatch):
    compiled = []
    monkeypatch.setattr(side_by_side, "is_cold", lambda: True)
    monkeypatch.setattr(side_by_side, "compile_side_by_side", lambda *_how: compiled.append(True))
    (folder / "empty.log").write_bytes(b"")
    assert run(["slam", "empty.log", "-o", "out.json", "--threads", "2"]) == 65
    assert capsys.readouterr().err == "nscan-cli: empty.log: is empty; give a log with laser scans\n"
    assert not compiled
    (folder / "good.log").write_text(room_log(5))
    assert run(["slam", "good.log", "-o", "out.json", "--threads", "2"]) == 0
    assert capsys.readouterr().err.startswith("compiling ")
    assert compiled


@pytest.mark.parametrize(
    ("content", "code", "said"),
    [
        (None, 66, "saved.json: no such file"),
        (b"", 65, "saved.json"),
        (b"{", 65, "saved.json, line 1"),
        (PNG, 65, "saved.json"),
    ],
)
def test_a_saved_graph_that_is_none(folder, capsys, content, code, said):
    if content is not None:
        (folder / "saved.json").write_bytes(content)
    assert run(["slam", "--from", "saved.json", "-o", "out.json"]) == code
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert said in err
    assert not (folder / "out.json").exists()


@pytest.mark.parametrize(
    "options",
    [
        ["--max-scans", "4"],
        ["--relations", "both"],
        ["--no-loops"],
        ["--calibrate"],
        ["--verify"],
        ["--every", "2"],
    ],
)
def test_options_of_mapping_do_not_go_with_a_saved_graph(folder, capsys, options):
    (folder / "saved.json").write_bytes(write_graph(small_graph()))
    assert run(["slam", "--from", "saved.json", "-o", "out.json", *options]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert "--relations, --calibrate, --no-loops and --verify cannot be combined with --from" in err
    assert not (folder / "out.json").exists()


def test_an_existing_output_survives_a_failure(folder):
    (folder / "graph.json").write_text("old")
    assert run(["slam", "none.log", "-o", "graph.json"]) == 66
    assert (folder / "graph.json").read_text() == "old"
