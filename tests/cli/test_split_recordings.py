"""Folders that a recorder has left, and recordings of several files, as a user of the commands meets them."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from nscan_cli.cli.main import run
from tests.cli.room_logs import COUNT, room_drive
from tests.logs.recordings.ros import split_bag2


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording of three files in a folder, and what `slam` has made of it."""
    folder = tmp_path_factory.mktemp("mapped")
    split_bag2(room_drive(), folder / "my_bag", "MCAP")
    outputs = ["-o", str(folder / "a.json"), "--map", str(folder / "a.png"), "--depfile", str(folder / "a.d")]
    assert run(["slam", f"{folder / 'my_bag'}/", "-q", *outputs]) == 0
    return folder


@pytest.fixture
def here(mapped: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with all of that."""
    shutil.copytree(mapped, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


def inputs(graph: Path) -> list[dict[str, object]]:
    found: list[dict[str, object]] = json.loads(graph.read_text())["provenance"]["inputs"]
    return found


def test_the_graph_has_each_file_and_the_depfile_names_it(here):
    files = [here / "my_bag" / f"my_bag_{k}.mcap" for k in range(3)]
    assert inputs(here / "a.json") == [
        {
            "name": file.name,
            "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
            "bytes": file.stat().st_size,
        }
        for file in files
    ]
    rule = Path("a.d").read_text().partition(":")[2].split()
    assert [Path(path).name for path in rule] == [file.name for file in files]
    assert all(Path(path).is_file() for path in rule)


def test_the_files_give_the_bytes_of_the_folder(here):
    files = [f"my_bag/my_bag_{k}.mcap" for k in (2, 0, 1)]
    assert run(["slam", *files, "-q", "-o", "b.json"]) == 0
    assert (here / "b.json").read_bytes() == (here / "a.json").read_bytes()


def test_a_recording_of_one_file_gives_the_same_scans_and_poses(here):
    split_bag2(room_drive(), here / "one", "MCAP", 1)
    assert run(["slam", "one", "-q", "-o", "one.json"]) == 0
    one, split = (json.loads(Path(name).read_text()) for name in ("one.json", "a.json"))
    assert one["nodes"] == split["nodes"]
    assert one["relations"] == split["relations"]


def test_render_finds_the_log_in_a_folder_and_takes_it_in_either_way(here, capsys):
    for log in ([], ["my_bag"], [f"my_bag/my_bag_{k}.mcap" for k in range(3)]):
        assert run(["render", "a.json", *log, "-q", "-o", "b.png"]) == 0
        assert (here / "b.png").read_bytes() == (here / "a.png").read_bytes()
    for file in (here / "my_bag").glob("*.mcap"):
        file.rename(here / file.name)
    assert run(["render", "a.json", "-q", "-o", "b.png"]) == 0
    (here / "my_bag_1.mcap").unlink()
    assert run(["render", "a.json", "-q", "-o", "b.png"]) == 66
    said = capsys.readouterr().err
    assert "its log my_bag_0.mcap and 2 more files is neither" in said
    assert said.endswith("; give it, or its folder such as my_bag/, as LOG\n")


def test_among_folders_with_equal_names_the_one_of_the_right_sizes_is_taken(here):
    split_bag2(room_drive()[:-4], here / "again", "MCAP")
    for file in (here / "again").glob("*.mcap"):
        file.rename(file.with_name(file.name.replace("again", "my_bag")))
    assert run(["render", "a.json", "-q", "-o", "b.png"]) == 0


def test_render_checks_every_file(here, capsys):
    last = here / "my_bag" / "my_bag_2.mcap"
    split_bag2(room_drive()[:-2], here / "other", "MCAP")
    shutil.copy(here / "other" / "other_2.mcap", last)
    assert run(["render", "a.json", "my_bag", "-o", "b.png"]) == 65
    said = capsys.readouterr().err
    assert (
        "my_bag: is not the log of a.json: my_bag_2.mcap is not among its files, or has another SHA-256"
        in said
    )
    last.unlink()
    assert run(["render", "a.json", "my_bag/my_bag_0.mcap", "my_bag/my_bag_1.mcap", "-o", "b.png"]) == 65
    assert run(["slam", "--from", "a.json", "my_bag", "-q", "-o", "b.json"]) == 65


def test_a_saved_graph_is_refined_with_its_folder(here):
    assert run(["slam", "--from", "a.json", "-q", "-o", "b.json", "--depfile", "b.d"]) == 0
    assert inputs(here / "b.json") == inputs(here / "a.json")
    assert len(Path("b.d").read_text().partition(":")[2].split()) == 4


def test_the_other_commands_take_folders(here, capsys):
    assert run(["info", "my_bag", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["file"], facts["scans"], facts["warnings"]) == ("my_bag", COUNT, [])
    assert facts["files"] == inputs(here / "a.json")
    assert facts["bytes"] == sum(file["bytes"] for file in facts["files"])
    assert run(["info", "my_bag"]) == 0
    text = capsys.readouterr().out
    assert f"my_bag_1.mcap, {facts['files'][1]['bytes']} bytes" in text
    assert all(file["sha256"] in text for file in facts["files"])
    assert run(["match", "my_bag/", "--reference", "2", "--scan", "6", "-q"]) == 0
    assert json.loads(capsys.readouterr().out)["provenance"]["inputs"] == facts["files"]
    nscan = ["nscan", "my_bag", "--scans", "2,6,9", "-q", "--initial", "a.json", "--prior", "a.json"]
    assert run(nscan) == 0
    assert len(json.loads(capsys.readouterr().out)["provenance"]["inputs"]) == 4


def test_outputs_replace_no_file_of_a_recording(here, capsys):
    assert run(["slam", "my_bag", "-q", "-o", "my_bag/my_bag_1.mcap"]) == 2
    assert "my_bag_1.mcap is both an input and an output" in capsys.readouterr().err
    assert run(["match", "my_bag", "--reference", "1", "--scan", "2", "--plot", "my_bag/my_bag_1.mcap"]) == 2
    assert run(["render", "a.json", "-o", "b.png", "--mcap", "my_bag/my_bag_1.mcap"]) == 2


def test_logs_that_do_not_go_together_are_a_mistake(here, capsys):
    (here / "x.log").write_text("FLASER 1 1 0 0 0 0 0 0 1 h 1\n")
    for command in (["slam", "-o", "b.json"], ["info"]):
        assert run([*command, "my_bag/my_bag_0.mcap", "x.log"]) == 2
        assert "x.log: is CARMEN text, not a recording" in capsys.readouterr().err
    assert run(["info"]) == 2
    assert "Missing argument 'LOG" in capsys.readouterr().err
    assert run(["info", str(here)]) == 66
    assert "is a folder without a recording, it holds a.d, a.json" in capsys.readouterr().err


def test_a_database_with_a_write_ahead_log_beside_it(here):
    """Both are inputs, and both are found and checked again."""
    import sqlite3
    from contextlib import closing

    made = split_bag2(room_drive(), here / "made", "SQLITE3", 1) / "made_0.db3"
    with closing(sqlite3.connect(made)) as database:
        database.execute("PRAGMA journal_mode=WAL")
        database.execute("UPDATE messages SET timestamp = timestamp + 1")
        database.commit()
        shutil.copy(made, here / "lab.db3")
        shutil.copy(f"{made}-wal", here / "lab.db3-wal")
    assert run(["slam", "lab.db3", "-q", "-o", "lab.json", "--map", "lab.png", "--depfile", "lab.d"]) == 0
    assert [file["name"] for file in inputs(here / "lab.json")] == ["lab.db3", "lab.db3-wal"]
    assert Path("lab.d").read_text().endswith(": lab.db3 lab.db3-wal\n")
    assert run(["render", "lab.json", "-q", "-o", "b.png"]) == 0
    assert (here / "b.png").read_bytes() == (here / "lab.png").read_bytes()
    (here / "lab.db3-wal").unlink()
    assert run(["render", "lab.json", "-q", "-o", "b.png"]) == 65
