"""The report of the nights for scripts: report.json."""

from __future__ import annotations

import json
from typing import Any

from nscan_cli import __version__
from nscan_cli.files.text import json_bytes
from nscan_cli.nightly.regression_check import CheckResult, MeasuredErrors, headline


def report_document(verdicts: list[CheckResult]) -> dict[str, Any]:
    """What the page shows, as an object for JSON; lengths in m, angles in degrees, times in s.

    Everything that differs from call to call is under the keys `times`.
    """
    return {
        "format": "nscan-cli nightly",
        "version": "1.0",
        "tool": {"name": "nscan-cli", "version": __version__},
        "units": {"translation": "m", "rotation": "deg", "time": "s"},
        "good": not any(verdict.is_failure for verdict in verdicts),
        "headline": headline(verdicts),
        "logs": [_log_json(verdict) for verdict in verdicts],
        "times": {"finished": finish_time(verdicts)},
    }


def json_report(verdicts: list[CheckResult]) -> bytes:
    """report.json."""
    text = json.dumps(report_document(verdicts), indent=1, ensure_ascii=False, allow_nan=False)
    return json_bytes(text + "\n")


def finish_time(verdicts: list[CheckResult]) -> str | None:
    """When the last of the logs was done (UTC, ISO 8601)."""
    return max(
        (verdict.nights[-1]["times"]["finished"] for verdict in verdicts if verdict.nights), default=None
    )


def _log_json(verdict: CheckResult) -> dict[str, Any]:
    entry, last, errors = verdict.entry, verdict.last, verdict.errors
    return {
        "name": entry.name,
        "status": verdict.status,
        "reasons": verdict.reasons,
        "notes": verdict.notes,
        "bounds": {"translation": entry.max_translation, "rotation": entry.max_rotation},
        "published": entry.published,
        "about": entry.about,
        "optional": entry.optional,
        "sources": entry.sources,
        "errors": _errors_json(errors),
        "before": _errors_json(MeasuredErrors.of(verdict.before)),
        "counts": None if last is None else last["counts"],
        "evaluation": None if last is None else last["evaluation"],
        "outputs": [] if last is None else [f"{entry.name}/{name}" for name in last["outputs"]],
        "nights": [
            {
                "tool": night["tool"],
                "outcome": night["outcome"],
                "errors": _errors_json(MeasuredErrors.of(night)),
            }
            for night in verdict.nights
        ],
        "times": {"nights": [night["times"] for night in verdict.nights]},
    }


def _errors_json(errors: MeasuredErrors | None) -> dict[str, Any] | None:
    if errors is None:
        return None
    return {"what": errors.what, "translation": errors.metres, "rotation": errors.degrees}
