"""Where the report goes: report.html and report.json in the folder of the nights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nscan_cli.files.outputs import write_whole
from nscan_cli.nightly.manifest import Entry
from nscan_cli.nightly.night import Plan
from nscan_cli.nightly.night_history import read_nights
from nscan_cli.nightly.report_json import as_json
from nscan_cli.nightly.report_page import page
from nscan_cli.nightly.verdict import Verdict, verdict


def publish(title: str, entries: Sequence[Entry], planned: Plan, folder: Path) -> list[Verdict]:
    """Write the report on what is in the folder, and return what it says. Raises OutputError."""
    absent = [entry.name for entry in planned.absent]
    verdicts = [
        verdict(
            entry,
            read_nights(folder / entry.name),
            planned.notes.get(entry.name, []),
            absent=entry.name in absent,
        )
        for entry in entries
    ]
    for name, content in (("report.json", as_json(verdicts)), ("report.html", page(title, verdicts, folder))):
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            write_whole(str(path), content)
    return verdicts
