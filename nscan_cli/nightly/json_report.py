"""The report for scripts: report.json."""

from __future__ import annotations

import json
from typing import Any

from nscan_cli import __version__
from nscan_cli.files.provenance import as_parameters
from nscan_cli.files.text import json_bytes
from nscan_cli.nightly.regression_check import CheckResult, MeasuredErrors, RegressionOptions, headline


def report_document(checks: list[CheckResult]) -> dict[str, Any]:
    """The report as an object for JSON; lengths in m, angles in degrees, times in s.

    What differs between two runs on the same inputs is under keys `times`.
    """
    return {
        "format": "nscan-cli nightly",
        "version": "1.0",
        "tool": {"name": "nscan-cli", "version": __version__},
        "units": {"translation": "m", "rotation": "deg", "time": "s"},
        "good": not any(check.is_failure for check in checks),
        "headline": headline(checks),
        "parameters": as_parameters(RegressionOptions()),
        "logs": [_log_json(check) for check in checks],
        "times": {"finished": finish_time(checks)},
    }


def json_report(checks: list[CheckResult]) -> bytes:
    """The bytes of report.json."""
    text = json.dumps(report_document(checks), indent=1, ensure_ascii=False, allow_nan=False)
    return json_bytes(text + "\n")


def finish_time(checks: list[CheckResult]) -> str | None:
    """When the last log was finished (UTC, ISO 8601)."""
    return max((check.runs[-1]["times"]["finished"] for check in checks if check.runs), default=None)


def _log_json(check: CheckResult) -> dict[str, Any]:
    entry, last, errors = check.entry, check.last, check.errors
    return {
        "name": entry.name,
        "status": check.status,
        "reasons": check.reasons,
        "notes": check.notes,
        "bounds": {"translation": entry.max_translation, "rotation": entry.max_rotation},
        "published": entry.published,
        "about": entry.about,
        "optional": entry.optional,
        "sources": entry.sources,
        "errors": _errors_json(errors),
        "before": _errors_json(MeasuredErrors.of(check.previous)),
        "counts": None if last is None else last["counts"],
        "evaluation": None if last is None else last["evaluation"],
        "outputs": [] if last is None else [f"{entry.name}/{name}" for name in last["outputs"]],
        "nights": [
            {"tool": run["tool"], "outcome": run["outcome"], "errors": _errors_json(MeasuredErrors.of(run))}
            for run in check.runs
        ],
        "times": {"nights": [run["times"] for run in check.runs]},
    }


def _errors_json(errors: MeasuredErrors | None) -> dict[str, Any] | None:
    if errors is None:
        return None
    return {"what": errors.measure, "translation": errors.metres, "rotation": errors.degrees}
