"""The report for people: one HTML file that needs no other files."""

from __future__ import annotations

from html import escape
from pathlib import Path

from nscan_cli import __version__
from nscan_cli.files.counting import counted
from nscan_cli.files.text import printable
from nscan_cli.nightly.html_log_section import (
    STATUS_SYMBOLS,
    absent_section,
    error_change,
    log_section,
    readable_time,
    real_time_factor,
    run_time,
    status_badge,
    time_span,
)
from nscan_cli.nightly.json_report import finish_time
from nscan_cli.nightly.regression_check import ATTENTION, STATUS_ORDER, CheckResult, Status, headline


def html_report(title: str, checks: list[CheckResult], folder: Path) -> bytes:
    """The bytes of report.html; `folder` has the logs' results, `title` is the manifest's name.

    What differs between two runs on the same inputs stands in elements of the class `time`.
    """
    status: Status = next(
        (each for each in STATUS_ORDER if each in {check.status for check in checks}), "good"
    )
    when = finish_time(checks)
    stamp = "" if when is None else f'<time class="time" datetime="{when}">{readable_time(when)}</time>'
    never = [check for check in checks if check.status == "absent" and check.last is None]
    seen = [check for check in checks if check not in never]
    count = sum(check.status == "absent" for check in checks)
    missing = f"{count} more {'is' if count == 1 else 'are'} not there. " if count else ""
    style, script = (
        Path(__file__).with_name(f"report.{ending}").read_text("utf-8") for ending in ("css", "js")
    )
    content = "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{STATUS_SYMBOLS[status]} {escape(title)}: {escape(headline(checks))}</title>",
            '<link rel="icon" href="data:,">',
            f"<style>\n{style}</style>",
            "</head>",
            "<body>",
            "<main>",
            f'<section class="banner {status}">',
            f'<span class="sign" aria-hidden="true">{STATUS_SYMBOLS[status]}</span>',
            f"<h1>{escape(headline(checks))}</h1>",
            f'<p class="soft">{missing}{escape(title)} {stamp}</p>',
            "</section>",
            *_attention_list(checks),
            *_overview(seen),
            *(
                log_section(check, folder)
                for check in sorted(seen, key=lambda each: STATUS_ORDER.index(each.status))
            ),
            *absent_section(never),
            f"<footer>nscan-cli {escape(__version__)}. Errors in metres: the mean on relations (Kümmerle et "
            "al. 2009), or the RMSE of the ATE against a reference, after the rigid motion that fits best. "
            "Worse: risen by more than 5 % and by more than 0.5 mm or 0.01° since the previous run.</footer>",
            "</main>",
            f"<script>\n{script}</script>",
            "</body>",
            "</html>",
        ]
    )
    return printable(content + "\n").encode()


def _attention_list(checks: list[CheckResult]) -> list[str]:
    """The logs that need attention with the reasons, the most urgent first."""
    items = [
        f'<li class="{check.status}"><a href="#{check.entry.name}">{check.entry.name}</a> '
        f"{escape('; '.join(check.reasons))}</li>"
        for status in ATTENTION
        for check in checks
        if check.status == status
    ]
    return ['<ul class="look">', *items, "</ul>"] if items else []


def _overview(checks: list[CheckResult]) -> list[str]:
    """A table with a row for every log, in the manifest's order."""
    heads = [
        ("log", ""),
        ("", ""),
        ("error, m", ""),
        ("change", ""),
        ("bound", "wide"),
        ("best published", "wide"),
        ("rotation", "wide"),
        ("time", "wide"),
        ("real time", "wide"),
    ]
    rows = [f"<th{_class(kind)}>{name}</th>" for name, kind in heads]
    return [
        '<div class="overview"><table>',
        f"<thead><tr>{''.join(rows)}</tr></thead>",
        "<tbody>",
        *(_row(check) for check in checks),
        "</tbody></table></div>",
    ]


def _row(check: CheckResult) -> str:
    entry, is_now = check.entry, check.status not in ("failed", "absent")
    errors = check.errors if is_now else None
    best = min(entry.published.values(), default=None)
    cells = [
        (status_badge(check) + (_notes(check) if is_now else ""), ""),
        ("" if errors is None else f"{errors.metres:.4f}", "number"),
        (error_change(check) if is_now else "", "number"),
        ("" if entry.max_translation is None else f"{entry.max_translation:g}", "number wide"),
        ("" if best is None else f"{best:.4f}", "number wide"),
        ("" if errors is None else f"{errors.degrees:.2f}°", "number wide"),
        (time_span(run_time(check)) if is_now else "", "number wide"),
        (time_span(real_time_factor(check)) if is_now else "", "number wide"),
    ]
    name = f'<th><a href="#{entry.name}">{entry.name}</a></th>'
    return f"<tr>{name}{''.join(f'<td{_class(kind)}>{text}</td>' for text, kind in cells)}</tr>"


def _notes(check: CheckResult) -> str:
    """The number of notes, which are shown in the log's section."""
    return f' <span class="soft">{counted(len(check.notes), "note")}</span>' if check.notes else ""


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""
