"""The report of the nights for people: one HTML file that needs no other."""

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


def html_report(title: str, verdicts: list[CheckResult], folder: Path) -> bytes:
    """report.html of the folder that has the logs' results; `title` is the manifest's name.

    Whatever differs from call to call stands in elements of the class `time`.
    """
    status: Status = next(
        (each for each in STATUS_ORDER if each in {verdict.status for verdict in verdicts}), "good"
    )
    when = finish_time(verdicts)
    stamp = "" if when is None else f'<time class="time" datetime="{when}">{readable_time(when)}</time>'
    never = [verdict for verdict in verdicts if verdict.status == "absent" and verdict.last is None]
    seen = [verdict for verdict in verdicts if verdict not in never]
    count = sum(verdict.status == "absent" for verdict in verdicts)
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
            f"<title>{STATUS_SYMBOLS[status]} {escape(title)}: {escape(headline(verdicts))}</title>",
            '<link rel="icon" href="data:,">',
            f"<style>\n{style}</style>",
            "</head>",
            "<body>",
            "<main>",
            f'<section class="banner {status}">',
            f'<span class="sign" aria-hidden="true">{STATUS_SYMBOLS[status]}</span>',
            f"<h1>{escape(headline(verdicts))}</h1>",
            f'<p class="soft">{missing}{escape(title)} {stamp}</p>',
            "</section>",
            *_to_look_at(verdicts),
            *_overview(seen),
            *(
                log_section(verdict, folder)
                for verdict in sorted(seen, key=lambda each: STATUS_ORDER.index(each.status))
            ),
            *absent_section(never),
            f"<footer>nscan-cli {escape(__version__)}. Errors in metres: the mean on relations (Kümmerle et "
            "al. 2009), or the RMSE of the ATE against a reference, after the rigid motion that fits best. "
            "Worse: by more than 5 % and 0.5 mm, or 0.01°, since the night before.</footer>",
            "</main>",
            f"<script>\n{script}</script>",
            "</body>",
            "</html>",
        ]
    )
    return printable(content + "\n").encode()


def _to_look_at(verdicts: list[CheckResult]) -> list[str]:
    """What asks for a look, the worst first."""
    items = [
        f'<li class="{verdict.status}"><a href="#{verdict.entry.name}">{verdict.entry.name}</a> '
        f"{escape('; '.join(verdict.reasons))}</li>"
        for status in ATTENTION
        for verdict in verdicts
        if verdict.status == status
    ]
    return ['<ul class="look">', *items, "</ul>"] if items else []


def _overview(verdicts: list[CheckResult]) -> list[str]:
    """A row for every log, in the manifest's order."""
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
        *(_row(verdict) for verdict in verdicts),
        "</tbody></table></div>",
    ]


def _row(verdict: CheckResult) -> str:
    entry, is_now = verdict.entry, verdict.status not in ("failed", "absent")
    errors = verdict.errors if is_now else None
    best = min(entry.published.values(), default=None)
    cells = [
        (status_badge(verdict) + (_notes(verdict) if is_now else ""), ""),
        ("" if errors is None else f"{errors.metres:.4f}", "number"),
        (error_change(verdict) if is_now else "", "number"),
        ("" if entry.max_translation is None else f"{entry.max_translation:g}", "number wide"),
        ("" if best is None else f"{best:.4f}", "number wide"),
        ("" if errors is None else f"{errors.degrees:.2f}°", "number wide"),
        (time_span(run_time(verdict)) if is_now else "", "number wide"),
        (time_span(real_time_factor(verdict)) if is_now else "", "number wide"),
    ]
    name = f'<th><a href="#{entry.name}">{entry.name}</a></th>'
    return f"<tr>{name}{''.join(f'<td{_class(kind)}>{text}</td>' for text, kind in cells)}</tr>"


def _notes(verdict: CheckResult) -> str:
    """How many notes the card has, for those who do not get down there."""
    return f' <span class="soft">{counted(len(verdict.notes), "note")}</span>' if verdict.notes else ""


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""
