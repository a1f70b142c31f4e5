"""Where the report goes: report.html and report.json in the folder of the nights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nscan_cli.files.outputs import write_atomically
from nscan_cli.nightly.html_report import html_report
from nscan_cli.nightly.json_report import json_report
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.plan import Plan
from nscan_cli.nightly.regression_check import CheckResult, check_log
from nscan_cli.nightly.run_history import read_runs


def write_reports(
    title: str, entries: Sequence[ManifestEntry], planned: Plan, folder: Path
) -> list[CheckResult]:
    """Write the report on what is in the folder, and return what it says. Raises OutputError."""
    absent = [entry.name for entry in planned.absent]
    verdicts = [
        check_log(
            entry,
            read_runs(folder / entry.name),
            planned.notes.get(entry.name, []),
            absent=entry.name in absent,
        )
        for entry in entries
    ]
    for name, content in (
        ("report.json", json_report(verdicts)),
        ("report.html", html_report(title, verdicts, folder)),
    ):
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            write_atomically(str(path), content)
    return verdicts
