"""Write the report: report.html and report.json in the results folder."""

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
    """Check every log with the results in the folder, and write the report. Raises OutputError."""
    absent, notes = [entry.name for entry in planned.absent], planned.notes
    checks = [
        check_log(entry, read_runs(folder / entry.name), notes.get(entry.name, []), entry.name in absent)
        for entry in entries
    ]
    for name, content in (
        ("report.json", json_report(checks)),
        ("report.html", html_report(title, checks, folder)),
    ):
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            write_atomically(str(path), content)
    return checks
