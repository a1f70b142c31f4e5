"""`nscan-cli nightly` as a user meets it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from nscan_cli.cli.main import run
from tests.data import SAMPLE_LOGS, data_file
from tests.nightly.small_logs import copy_of, results, write_logs


def report(folder: Path):
    return json.loads((folder / "report.json").read_bytes(), parse_constant=pytest.fail)


def test_the_results_are_those_of_slam_and_evaluate(small, undisturbed, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    outputs = ["-o", "graph.json", "--map", "map.png", "--trajectory", "trajectory.tum"]
    assert run(["slam", str(small.parent / "two.log"), *outputs, "-q"]) == 0
    for name in ("graph.json", "map.png", "map.yaml", "trajectory.tum"):
        assert (undisturbed / "two" / name).read_bytes() == (tmp_path / name).read_bytes(), name
    assert run(["evaluate", "graph.json", "--reference", str(small.parent / "two.tum"), "--json"]) == 0
    document = report(undisturbed)
    assert document["good"] is True
    assert document["headline"] == "All 3 logs are good"
    assert [log["name"] for log in document["logs"]] == ["one", "two", "three"]
    assert document["logs"][1]["evaluation"] == json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("jobs", ["1", "3"])
def test_the_same_bytes_whatever_the_jobs(small, undisturbed, tmp_path, jobs):
    assert run(["nightly", str(small), "-o", str(tmp_path / "n"), "--jobs", jobs, "-q"]) == 0
    assert results(tmp_path / "n") == results(undisturbed)


def test_a_second_call_does_nothing_and_says_so_without_loading_anything(small, undisturbed, tmp_path):
    folder = copy_of(undisturbed, tmp_path / "nights")
    before = {path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in folder.rglob("*.*")}
    script = (
        "import sys; from nscan_cli.cli.main import run; assert run(sys.argv[1:]) == 0; "
        "heavy = {'numpy', 'scipy', 'numba', 'PIL', 'rich', 'distributed'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    call = [sys.executable, "-c", script, "nightly", str(small), "-o", str(folder)]
    said = subprocess.run(call, check=True, capture_output=True, text=True)
    assert said.stdout == ""
    assert said.stderr == (
        f"nothing to do: all 3 logs are up to date\nAll 3 logs are good: {folder}/report.html\n"
    )
    assert {path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in folder.rglob("*.*")} == before


def test_what_has_changed_is_done_again_and_compared(small, undisturbed, tmp_path, capsys):
    folder = copy_of(undisturbed, tmp_path / "nights")
    changed = tmp_path / "changed.toml"
    text = small.read_text().replace('name = "two"', 'name = "two"\nparameters = { every = 3 }')
    changed.write_text(text)
    arguments = ["nightly", str(changed), "-o", str(folder), "--data", str(small.parent)]
    assert run(arguments) == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("two: RMSE of the ATE 0.")
    one, two, _three = report(folder)["logs"]
    assert [len(log["nights"]) for log in (one, two)] == [1, 2]
    assert one["before"] is None
    assert two["before"] == two["nights"][0]["errors"] == report(undisturbed)["logs"][1]["errors"]
    assert two["counts"]["scans"] == 6


def test_failures_have_their_reasons_and_code_3(small, undisturbed, tmp_path, capsys):
    """A damaged log, one above its bound, two that are not there, of which one is optional; one is fine."""
    folder = copy_of(undisturbed, tmp_path / "nights")
    logs = tmp_path / "logs"
    logs.mkdir()
    write_logs(logs)
    (logs / "one.log").write_text("no log")
    text = (logs / "small.toml").read_text()
    head, _, tail = text.partition('name = "two"')
    tail = tail.replace("max_translation = 0.5", "max_translation = 0", 1)
    text = f'{head}name = "two"{tail}\n[[log]]\nname = "four"\nsource = "https://example.org/four.log"\n'
    text += '[[log]]\nname = "five"\nsource = "https://example.org/five.log"\noptional = true\n'
    (logs / "small.toml").write_text(text)
    assert run(["nightly", str(logs / "small.toml"), "-o", str(folder), "-q"]) == 3
    one, two, four, last = capsys.readouterr().err.splitlines()
    assert one.startswith("nscan-cli: one: log/one.log: is ")
    assert two.startswith("nscan-cli: two: RMSE of the ATE 0.")
    assert two.endswith(" m is above 0 m")
    assert four == ("nscan-cli: four: four.log.gz is missing; download from https://example.org/four.log")
    assert last == f"nscan-cli: 2 of 4 logs failed, 1 is above its bound; see {folder}/report.html"
    document = report(folder)
    assert document["good"] is False
    assert [log["status"] for log in document["logs"]] == ["failed", "above", "good", "failed", "absent"]
    # What the last good night has left is still there.
    assert document["logs"][0]["errors"] is not None
    assert (folder / "one" / "map.png").exists()
    # Nothing is mended by a second look; only what failed is tried again.
    assert run(["nightly", str(logs / "small.toml"), "-o", str(folder)]) == 3
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == (
        f"five: {logs}/five.log.gz was not found, nor with .log, .clf.gz, .clf, .script.gz, .script, .mcap, "
        ".bag or .db3; skipped; download from https://example.org/five.log"
    )
    said = [line.partition(":")[0] for line in lines[1:]]
    assert sorted(said) == ["four", "nscan-cli", "nscan-cli", "nscan-cli", "nscan-cli", "one"]


def test_optional_logs_that_are_not_there_are_one_line(small, undisturbed, tmp_path, capsys):
    folder, logs = copy_of(undisturbed, tmp_path / "nights"), tmp_path / "logs"
    logs.mkdir()
    write_logs(logs)
    more = [
        f'[[log]]\nname = "{name}"\noptional = true\nabout = "Where {name} was <driven>."\n'
        f'source = "https://example.org/{name}.log"\n'
        for name in ("four", "five", "six")
    ]
    (logs / "small.toml").write_text((logs / "small.toml").read_text() + "".join(more))
    assert run(["nightly", str(logs / "small.toml"), "-o", str(folder)]) == 0
    first_line, *_ = capsys.readouterr().err.splitlines()
    assert first_line == "not found, skipped: four, five, six; the report has their sources"
    page = (folder / "report.html").read_text()
    assert page.count('<section class="log missing">') == 1
    for name in ("four", "five", "six"):
        assert f'<dt id="{name}">{name}</dt><dd>Where {name} was &lt;driven&gt;.' in page
        assert f'<a href="https://example.org/{name}.log">' in page
        assert f'<a href="#{name}">' not in page
    assert [log["about"] for log in report(folder)["logs"]][3:] == [
        f"Where {name} was <driven>." for name in ("four", "five", "six")
    ]


def test_force(small, undisturbed, tmp_path, capsys):
    folder = copy_of(undisturbed, tmp_path / "nights")
    assert run(["nightly", str(small), "-o", str(folder), "--force"]) == 0
    assert len(capsys.readouterr().err.splitlines()) == 4
    assert results(folder) == results(undisturbed)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["none.toml", "-o", "out"], 66, "none.toml: no such file; check the path"),
        (["bad.toml", "-o", "out"], 65, "bad.toml, log 1 (a): has an unknown key 'pth'; known: name, path,"),
        (["empty.toml", "-o", "out"], 66, "empty.toml: none of its logs was found, such as a.log.gz (or"),
        (["kuemmerle", "-o", "out"], 2, "nightly: kuemmerle has no logs of its own; give their folder with"),
        (["kuemmerle", "-o", "out", "--data", "fine.log"], 66, "--data fine.log: is not a folder; give"),
        (["fine.toml", "-o", "out", "--data", "nowhere"], 66, "--data nowhere: is not a folder; give"),
        (["fine.toml", "-o", "no/out"], 73, "no/out: the folder no does not exist; create it first"),
        (["fine.toml", "-o", "fine.toml"], 73, "fine.toml: is not a folder; name another"),
        (["fine.toml", "-o", "out", "--scheduler", "x"], 2, "--scheduler x: is not an address of the form"),
        (["fine.toml"], 2, "nightly: Missing option --output"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_with_its_code(arguments, code, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if "--scheduler" in arguments:
        pytest.importorskip("distributed")
    Path("bad.toml").write_text('[[log]]\nname = "a"\npth = "x"')
    Path("empty.toml").write_text('[[log]]\nname = "a"\noptional = true')
    Path("fine.toml").write_text('[[log]]\nname = "fine"')
    Path("fine.log").write_text("no log")
    assert run(["nightly", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"nscan-cli: {message}")
    assert err.count("\n") == 1


def test_where_no_log_of_ones_own_is_there_the_night_has_failed_and_the_report_says_so(tmp_path, capsys):
    (tmp_path / "own.toml").write_text('[[log]]\nname = "a"\n[[log]]\nname = "b"\noptional = true')
    assert run(["nightly", str(tmp_path / "own.toml"), "-o", str(tmp_path / "nights"), "-q"]) == 3
    first, last = capsys.readouterr().err.splitlines()
    assert first == "nscan-cli: a: a.log.gz is missing"
    assert last == f"nscan-cli: The log failed; see {tmp_path}/nights/report.html"
    assert [log["status"] for log in report(tmp_path / "nights")["logs"]] == ["failed", "absent"]


@pytest.mark.parametrize("data", ["", "not_made_yet"])
def test_where_no_log_is_there_it_is_said_where_to_get_them(tmp_path, capsys, data):
    assert run(["nightly", "kuemmerle", "--data", str(tmp_path / data), "-o", str(tmp_path / "nights")]) == 66
    *lines, error = capsys.readouterr().err.splitlines()
    assert error.startswith("nscan-cli: kuemmerle: none of its logs was found")
    assert (
        "intel.log.gz (or .log, .clf.gz, .clf, .script.gz, .script, .mcap, .bag or .db3; downloads" in error
    )
    assert [line.partition(":")[0] for line in lines][:4] == ["intel", "fr079", "mit-csail", "mit-killian"]
    assert len(lines) == 6
    assert all("was not found; skipped; download from http" in line for line in lines)
    assert all(line.endswith(".relations") for line in lines[:4])
    assert list(tmp_path.iterdir()) == []


def test_other_names_of_a_log_that_is_not_there_are_said(tmp_path, capsys):
    assert run(["nightly", "radish", "--data", str(tmp_path), "-o", str(tmp_path / "nights")]) == 66
    first, *_ = capsys.readouterr().err.splitlines()
    assert "intel_lab.log.gz was not found, nor as intel or intel-lab; skipped; download" in first


def test_the_sample_logs_and_their_manifest(tmp_path):
    assert run(["nightly", str(SAMPLE_LOGS / "nightly.toml"), "-o", str(tmp_path / "nights"), "-q"]) == 0


@pytest.mark.logs
def test_a_shipped_manifest_over_real_logs(tmp_path, capsys):
    """One of its logs; the others of the folder are left out."""
    (tmp_path / "data").mkdir()
    for name in ("mit-csail.log.gz", "mit-csail.relations"):
        (tmp_path / "data" / name).symlink_to(data_file(name))
    folder = tmp_path / "nights"
    assert run(["nightly", "kuemmerle", "--data", str(tmp_path / "data"), "-o", str(folder)]) == 0
    assert "warning" not in capsys.readouterr().err
    logs = {log["name"]: log for log in report(folder)["logs"]}
    assert logs.pop("mit-csail")["status"] == "good"
    assert {log["status"] for log in logs.values()} == {"absent"}
