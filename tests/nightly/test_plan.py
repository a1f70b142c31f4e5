"""What is up to date, and what a folder remembers; by an engine that makes its results up."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from nscan_cli.logs.load import read_log
from nscan_cli.nightly import fingerprint
from nscan_cli.nightly import plan as plan_module
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.manifest_parameters import parameters_from
from nscan_cli.nightly.plan import make_plan
from nscan_cli.nightly.run import run_plan
from nscan_cli.nightly.run_history import read_runs
from nscan_cli.nightly.task import Outcome
from tests.nightly.small_logs import recordings


class Silent:
    def progress(self, *_progress):
        pass

    def finished(self, *_finished):
        pass


class Fake:
    """Gives each log the outcome that is asked for, and counts."""

    def __init__(self, *outcomes: Outcome):
        self.outcomes = list(outcomes)
        self.done: list[str] = []

    def __call__(self, tasks, scratch, report):
        for task in tasks:
            self.done.append(task.name)
            yield task, self.outcomes.pop(0)


def good(content: bytes = b"map") -> Outcome:
    return Outcome({"counts": {}, "evaluation": None, "times": {"seconds": 1.0}}, {"map.png": content})


@pytest.fixture
def entry(tmp_path: Path) -> ManifestEntry:
    (tmp_path / "a.log").write_text("a")
    (tmp_path / "a.tum").write_text("t")
    return ManifestEntry("a", {"log": tmp_path / "a.log", "reference": tmp_path / "a.tum"})


@pytest.fixture
def nights(tmp_path: Path) -> Path:
    (tmp_path / "nights").mkdir()
    return tmp_path / "nights"


def night(entry: ManifestEntry, folder: Path, *outcomes: Outcome, force: bool = False) -> Fake:
    fake = Fake(*outcomes)
    run_plan(make_plan([entry], folder, force), folder, fake, Silent())
    return fake


def is_done(entry: ManifestEntry, folder: Path) -> bool:
    return make_plan([entry], folder, False).up_to_date == [entry]


def test_what_is_done_is_up_to_date(entry, nights):
    assert not is_done(entry, nights)
    assert night(entry, nights, good()).done == ["a"]
    assert is_done(entry, nights)
    assert night(entry, nights).done == []
    assert night(entry, nights, good(), force=True).done == ["a"]
    assert not (nights / ".scratch").exists()


@pytest.mark.parametrize("change", ["log", "reference", "parameters", "code", "name", "output", "no output"])
def test_whatever_changes_makes_it_out_of_date(entry, nights, tmp_path, monkeypatch, change):
    night(entry, nights, good())
    if change in ("log", "reference"):
        entry.inputs[change].write_text("b")
    elif change == "parameters":
        entry = replace(entry, parameters=parameters_from("", {"end": 5}))
    elif change == "code":
        monkeypatch.setattr(fingerprint, "tool_key", lambda: "0.2.0")
    elif change == "name":
        entry = replace(entry, inputs={**entry.inputs, "log": entry.inputs["log"].rename(tmp_path / "b.log")})
    elif change == "output":
        (nights / "a" / "map.png").write_bytes(b"another")
    else:
        (nights / "a" / "map.png").unlink()
    assert not is_done(entry, nights)


def test_bounds_and_published_figures_are_no_reason_to_do_it_again(entry, nights):
    night(entry, nights, good())
    assert is_done(replace(entry, max_translation=0.1, published={"x": 1.0}, sources={"log": "y"}), nights)


def test_a_copy_of_the_log_elsewhere_is_the_same_log(entry, nights, tmp_path):
    night(entry, nights, good())
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy" / "a.log").write_text("a")
    assert is_done(replace(entry, inputs={**entry.inputs, "log": tmp_path / "copy" / "a.log"}), nights)


def test_a_failure_is_tried_again_and_told_once(entry, nights):
    night(entry, nights, Outcome.failed("no\nroom"))
    assert not is_done(entry, nights)
    night(entry, nights, Outcome.failed("no room"))
    assert [line["reason"] for line in read_runs(nights / "a")] == ["no room"]
    night(entry, nights, good())
    assert [line["outcome"] for line in read_runs(nights / "a")] == ["done"]


def test_a_night_for_every_change(entry, nights):
    night(entry, nights, good(b"1"))
    night(entry, nights, good(b"1"), force=True)
    entry.inputs["log"].write_text("b")
    night(entry, nights, good(b"2"))
    night(entry, nights, Outcome.failed("stopped"), force=True)
    assert [line["outcome"] for line in read_runs(nights / "a")] == ["done", "done", "failed"]
    assert (nights / "a" / "map.png").read_bytes() == b"2"
    assert not is_done(entry, nights)


def test_a_history_that_is_damaged_begins_anew(entry, nights):
    night(entry, nights, good())
    for damage in (b'{"key": 1', b"[]\n", b"\xff\n", b"{}\n"):
        (nights / "a" / "nights.jsonl").write_bytes(damage)
        assert not is_done(entry, nights)
        night(entry, nights, good())
        assert len(read_runs(nights / "a")) == 1


def test_logs_that_are_absent_or_unreadable_do_not_reach_the_engine(entry, nights, tmp_path):
    absent = ManifestEntry("b", {"log": tmp_path / "b.log"}, optional=True)
    folder = ManifestEntry("c", {"log": tmp_path})
    sources = {"log": "https://example.org/a.log", "relations": "https://example.org/d.relations"}
    inputs = {"log": tmp_path / "a.log", "relations": tmp_path / "d.relations"}
    lost = ManifestEntry("d", inputs, sources=sources)
    planned = make_plan([absent, folder, lost, entry], nights, False)
    assert planned.absent == [absent]
    assert [each.name for each, _reason in planned.unreadable] == ["c", "d"]
    fake = Fake(good())
    run_plan(planned, nights, fake, Silent())
    assert fake.done == ["a"]
    reason = read_runs(nights / "d")[0]["reason"]
    assert "d.relations: no such file" in reason
    assert reason.endswith("; download from https://example.org/d.relations")
    assert not (nights / "b").exists()


def test_a_log_that_is_not_there_has_failed_unless_it_is_optional(nights, tmp_path):
    entry = ManifestEntry("b", {"log": tmp_path / "b.log"}, sources={"log": "https://example.org/b.log"})
    planned = make_plan([entry], nights, False)
    assert planned.absent == []
    assert planned.unreadable == [(entry, "b.log is missing; download from https://example.org/b.log")]
    planned = make_plan([replace(entry, optional=True)], nights, False)
    assert (planned.absent, planned.unreadable) == ([replace(entry, optional=True)], [])


def test_an_optional_log_is_mapped_without_what_is_not_there_to_measure_it(entry, nights, tmp_path):
    (tmp_path / "a.tum").unlink()
    sources = {"reference": "https://example.org/a.tum"}
    optional = replace(entry, optional=True, sources=sources, sha256={"reference": "0" * 64})
    planned = make_plan([optional], nights, False)
    ((planned_entry, _key),) = planned.to_do
    assert planned_entry.inputs == {"log": tmp_path / "a.log"}
    assert planned.notes["a"] == [
        "a.tum is missing, so no errors are measured; download from https://example.org/a.tum"
    ]
    ((_, reason),) = make_plan([replace(optional, optional=False)], nights, False).unreadable
    assert "a.tum: no such file" in reason


def why(entry: ManifestEntry, folder: Path, force: bool = False) -> list[str]:
    return make_plan([entry], folder, force).rerun_reasons.get("a", ["nothing to do"])


def test_why_a_log_is_made_anew(entry, nights, tmp_path, monkeypatch):
    assert why(entry, nights) == []
    night(entry, nights, good())
    assert read_runs(nights / "a")[0]["times"]["anew"] == []
    assert why(entry, nights) == ["nothing to do"]
    assert why(entry, nights, force=True) == ["--force"]
    entry.inputs["log"].write_text("b")
    entry.inputs["reference"].write_text("u")
    assert why(entry, nights) == ["the log has changed", "the reference has changed"]
    entry = replace(entry, parameters=parameters_from("", {"end": 5, "mount": [0.1, 0, 90]}))
    changes = ["the parameter end is 5.0",
               "the parameter mount is [0.1, 0.0, 90.0]"]  # fmt: skip
    assert why(entry, nights)[2:] == changes
    night(entry, nights, good())
    assert read_runs(nights / "a")[1]["times"]["anew"][2:] == changes
    # The same parameters as the history has them are the same.
    assert why(entry, nights, force=True)[-1] == "--force"
    (nights / "a" / "map.png").unlink()
    assert why(entry, nights)[-1] == "results were missing or changed"
    entry = replace(entry, inputs={"log": entry.inputs["log"].rename(tmp_path / "b.log")})
    assert why(entry, nights)[:2] == ["the log was renamed from a.log to b.log", "the reference was removed"]
    night(entry, nights, Outcome.failed("no room"))
    assert why(entry, nights)[-1] == "the last run failed"
    night(entry, nights, good())
    for module in (fingerprint, plan_module):
        monkeypatch.setattr(module, "tool_key", lambda: "9.0.0-00")
    (reason,) = why(entry, nights)
    assert re.fullmatch(r"the code of nscan-cli has changed from version [\d.]+\w* to 9\.0\.0", reason)


def test_a_history_of_before_this_was_noted(entry, nights):
    night(entry, nights, good())
    file = nights / "a" / "nights.jsonl"
    line = json.loads(file.read_text())
    del line["made_from"], line["times"]["anew"]
    file.write_text(json.dumps(line) + "\n")
    assert why(entry, nights) == ["nothing to do"]
    entry.inputs["log"].write_text("b")
    assert why(entry, nights) == ["the log, its reference or its parameters have changed"]


def test_the_largest_log_is_begun_first(nights, tmp_path):
    entries = []
    for name, size in (("a", 1), ("b", 3), ("c", 2)):
        (tmp_path / f"{name}.log").write_text("x" * size)
        entries.append(ManifestEntry(name, {"log": tmp_path / f"{name}.log"}))
    assert [entry.name for entry, _key in make_plan(entries, nights, False).to_do] == ["b", "c", "a"]


def test_of_a_log_of_several_files_each_counts(nights, tmp_path):
    entries = recordings(tmp_path)
    before = dict(planned_keys(entries, nights))
    assert set(before) == {"lab", "split"}
    sha256 = read_log(str(tmp_path / "my_bag")).source.sha256
    assert make_plan([replace(entries[0], sha256={"log": sha256})], nights, False).notes == {"split": []}
    for file in ("my_bag/my_bag_2.mcap", "lab.db3-wal"):
        with (tmp_path / file).open("ab") as changed:
            changed.write(b"x")
    after = dict(planned_keys(entries, nights))
    assert all(after[name] != before[name] for name in before)


def planned_keys(entries: list[ManifestEntry], nights: Path) -> list[tuple[str, str]]:
    return [(each.name, key) for each, key in make_plan(entries, nights, False).to_do]


def test_another_file_than_the_manifest_means_is_noted(entry, nights):
    sha256 = "ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb"  # of "a"
    assert make_plan([replace(entry, sha256={"log": sha256})], nights, False).notes == {"a": []}
    (note,) = make_plan([replace(entry, sha256={"log": "0" * 64})], nights, False).notes["a"]
    assert note == "a.log differs from the file named in the manifest: its SHA-256 does not match"


def test_the_tools_key_is_of_the_code_that_makes_results():
    key = fingerprint.tool_key()
    assert fingerprint.tool_key.__wrapped__() == key
    assert len(key.rpartition("-")[2]) == 16
