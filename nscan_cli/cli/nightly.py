"""`nscan-cli nightly`: maps and evaluates every log of a manifest, and compares with the last run."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from nscan_cli.cli.compilation import announce_compiling
from nscan_cli.cli.progress import say
from nscan_cli.cli.shared_options import common_options
from nscan_cli.cli.subcommand import PATH, argument, option, subcommand
from nscan_cli.errors import CheckFailedError, InputMissingError
from nscan_cli.files.inputs import base_name
from nscan_cli.files.text import listed

if TYPE_CHECKING:
    from nscan_cli.nightly.manifest import ManifestEntry
    from nscan_cli.nightly.run import Executor, Outcomes
    from nscan_cli.nightly.task import ProgressCallback, Task


@subcommand(
    "nightly",
    ("nscan-cli nightly robots.toml -o nights", "every log of a manifest"),
    ("nscan-cli nightly kuemmerle --data logs -o nights", "a benchmark, with published errors"),
)
@argument("manifest", metavar="MANIFEST.toml", type=PATH, tells="A manifest, or one of those that come "
          "with nscan-cli: kuemmerle, radish.")  # fmt: skip
@option("-o", "--output", type=PATH, required=True, metavar="FOLDER",
        help="Folder for results, history and report; it is created.")  # fmt: skip
@option("--data", type=PATH, metavar="FOLDER", help="Folder of the logs. Default: that of the manifest.")
@option("--jobs", type=click.IntRange(1), metavar="N",
        help="Number of logs to run at a time. Default: one per processor.")  # fmt: skip
@option("--scheduler", metavar="ADDRESS",
        help="Run on a Dask cluster with this scheduler, tcp://HOST:PORT.")  # fmt: skip
@option("--timeout", type=click.FloatRange(0, min_open=True), default=3600, show_default=True, metavar="S",
        help="Time limit for a log, seconds; a log that takes longer fails.")  # fmt: skip
@option("--force", is_flag=True, help="Also run logs that are up to date.")
@common_options
def command(
    manifest: str,
    output: str,
    data: str | None,
    jobs: int | None,
    scheduler: str | None,
    timeout: float,
    force: bool,
    quiet: bool,
    **_verbosity: int,
) -> None:
    """Map and evaluate every log of MANIFEST.toml, and report what has changed since the last run.

    The manifests that come with nscan-cli need --data, the folder of their logs. Missing logs are listed with
    their download addresses. In other manifests a missing log counts as failed, unless it is optional. A log
    runs again if its bytes, its reference, its parameters or the code of nscan-cli have changed, or if it
    failed; the report gives the reason. If one log fails or times out, the others still run. After an
    interruption, the next call continues.

    The report is FOLDER/report.html and report.json. Exit code 3 if a log fails or exceeds its bound.
    """
    from nscan_cli.nightly.manifest import read_manifest
    from nscan_cli.nightly.plan import make_plan
    from nscan_cli.nightly.regression_check import headline
    from nscan_cli.nightly.report_files import write_reports
    from nscan_cli.nightly.results_folder import locked_folder
    from nscan_cli.nightly.run import run_plan

    entries = read_manifest(manifest, data)
    if all(entry.optional and not entry.is_there for entry in entries):
        for entry in entries:
            if "log" in entry.sources:
                _say_absent(entry, [], quiet)
        first = entries[0].inputs["log"]
        endings = _other_endings(entries[0])
        others = f" (or {listed(endings, 'or')}; downloads keep their names)" if endings else ""
        raise InputMissingError(
            f"{manifest}: none of its logs was found, such as {first}{others}; put logs there, or give "
            "--data FOLDER"
        )
    with locked_folder(output) as folder:
        planned = make_plan(entries, folder, force)
        if len(planned.absent) > 1:
            absent = ", ".join(entry.name for entry in planned.absent)
            say(f"not found, skipped: {absent}; the report has their sources", quiet)
        for entry in planned.absent if len(planned.absent) == 1 else ():
            _say_absent(entry, _other_endings(entry), quiet)
        for name, notes in planned.notes.items():
            for note in notes:
                say(f"{name}: warning: {note}", quiet)
        if planned.to_do or planned.unreadable:
            from nscan_cli.cli.nightly_progress import night_progress
            from nscan_cli.warm_up.side_by_side import TRACKING_KERNEL

            if scheduler is None:
                announce_compiling(TRACKING_KERNEL, quiet)
            names = [entry.name for entry, _key in planned.to_do]
            with night_progress(names, quiet) as lines:
                run_plan(planned, folder, _engine(jobs, scheduler, timeout), lines)
        else:
            logs = "the log is" if len(planned.up_to_date) == 1 else f"all {len(planned.up_to_date)} logs are"
            say(f"nothing to do: {logs} up to date", quiet)
        verdicts = write_reports(base_name(manifest), entries, planned, folder)

    report = os.path.join(output, "report.html")
    failures = [verdict for verdict in verdicts if verdict.is_failure]
    for verdict in failures:
        say(f"nscan-cli: {verdict.entry.name}: {'; '.join(verdict.reasons)}")
    if failures:
        raise CheckFailedError(f"{headline(verdicts)}; see {report}")
    say(f"{headline(verdicts)}: {report}", quiet)


def _say_absent(entry: ManifestEntry, endings: Sequence[str], quiet: bool) -> None:
    """Say that a log is not there, nor under its other names, nor with these endings."""
    nor = f", nor as {listed(entry.names[1:], 'or')}" if entry.names[1:] else ""
    nor += f", nor with {listed(endings, 'or')}" if endings else ""
    remedy = f"; download from {' and '.join(entry.sources.values())}" if entry.sources else ""
    say(f"{entry.name}: {entry.inputs['log']} was not found{nor}; skipped{remedy}", quiet)


def _other_endings(entry: ManifestEntry) -> tuple[str, ...]:
    """The endings that a log may have in place of that of its path; none if the manifest has the path."""
    from nscan_cli.nightly.manifest import LOG_SUFFIXES

    if not entry.names:
        return ()
    own = entry.inputs["log"].name.removeprefix(entry.names[0])
    return tuple(ending for ending in LOG_SUFFIXES if ending not in (own, ""))


def _engine(jobs: int | None, scheduler: str | None, timeout: float) -> Executor:
    """The function that runs tasks, in processes here or on a cluster."""
    if scheduler is not None:
        from nscan_cli.nightly import dask_executor

        return lambda tasks, _scratch, report: dask_executor.run_on_dask(tasks, scheduler, timeout, report)
    from nscan_cli.nightly import local_executor
    from nscan_cli.threads import available_threads

    def here(tasks: list[Task], scratch: Path, report: ProgressCallback) -> Outcomes:
        side_by_side = min(jobs or available_threads(), len(tasks))
        # The remaining processors become threads of the logs.
        threads = max(1, available_threads() // side_by_side)
        return local_executor.run_locally(tasks, side_by_side, timeout, scratch, report, threads)

    return here
