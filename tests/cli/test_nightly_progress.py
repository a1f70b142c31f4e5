"""What a person sees of a night."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from nscan_cli.cli.nightly_progress import LiveProgress, night_progress
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.run_history import RunRecord

DONE: RunRecord = {
    "outcome": "done",
    "counts": {"duration": 100.0},
    "evaluation": {"relations": {"translation": {"mean": 0.0128}, "rotation": {"mean": 0.2}}},
    "times": {"seconds": 4.0},
}
FAILED: RunRecord = {"outcome": "failed", "reason": "it died", "times": {}}


def entry(name: str) -> ManifestEntry:
    return ManifestEntry(name, {"log": Path("x")})


def test_a_live_line_for_each_log_and_no_more():
    screen = io.StringIO()
    columns = (TextColumn("{task.description}"), BarColumn(5), TextColumn("{task.fields[detail]}"))
    console = Console(file=screen, force_terminal=True, width=100, color_system=None)
    with Progress(*columns, console=console, auto_refresh=False) as bars:
        lines = LiveProgress(bars, ["intel", "fr079"])
        lines.progress("intel", 50, 200, 7)
        details = [task.fields["detail"] for task in bars.tasks]
        assert details == ["50/200 scans, 7 keyframes, 0 s", ""]
        assert [task.percentage for task in bars.tasks] == [25, 0]
        lines.finished(entry("intel"), DONE)
        lines.finished(entry("fr079"), FAILED)
        lines.finished(entry("unreadable"), FAILED)
        assert {task.description: task.fields["detail"] for task in bars.tasks} == {
            "intel": "mean on relations 0.0128 m, 4.0 s, 25 times real time",
            "fr079": "failed: it died",
            "unreadable": "failed: it died",
        }
        assert [task.percentage for task in bars.tasks] == [100, 0, 0]
        assert len(bars.tasks) == 3


@pytest.mark.parametrize("quiet", [False, True])
def test_plain_lines_where_there_is_no_terminal(quiet, capsys):
    with night_progress(["intel"], quiet) as lines:
        lines.progress("intel", 50, 200, 7)
        lines.finished(entry("intel"), {**DONE, "evaluation": None})
    said = "" if quiet else "intel: 4.0 s, 25 times real time\n"
    assert capsys.readouterr() == ("", said)
