"""The report for people: one HTML file that needs no other files, from report.html and log_section.html."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nscan_cli import __version__
from nscan_cli.files.text import counted, printable
from nscan_cli.mapping.viewer.viewer_parts import ViewerParts, viewer_parts
from nscan_cli.nightly.history_plot import history_svg
from nscan_cli.nightly.json_report import finish_time
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.regression_check import (
    ATTENTION,
    STATUS_ORDER,
    CheckResult,
    MeasuredErrors,
    Status,
    headline,
)

if TYPE_CHECKING:
    from markupsafe import Markup

STATUS_SYMBOLS: dict[Status, str] = {"good": "✓", "worse": "!", "above": "✗", "failed": "✗", "absent": "–"}
STATUS_WORDS: dict[Status, str] = {
    "good": "good",
    "worse": "worse",
    "above": "above its bound",
    "failed": "failed",
    "absent": "missing",
}


def html_report(title: str, checks: list[CheckResult], folder: Path) -> bytes:
    """The bytes of report.html; `folder` has the logs' results, `title` is the manifest's name.

    What differs between two runs on the same inputs stands in elements of the class `time`.
    """
    import jinja2
    from markupsafe import Markup

    beside = Path(__file__).parent
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(beside),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    by_urgency = sorted(checks, key=lambda check: STATUS_ORDER.index(check.status))
    status = by_urgency[0].status if checks else "good"
    never = [check for check in checks if check.status == "absent" and check.last is None]
    parts = viewer_parts()
    page = environment.get_template("report.html").render(
        title=title,
        headline=headline(checks),
        version=__version__,
        status=status,
        symbol=STATUS_SYMBOLS[status],
        status_words=STATUS_WORDS,
        finished=finish_time(checks),
        absent=sum(check.status == "absent" for check in checks),
        urgent=[check for check in by_urgency if check.status in ATTENTION],
        overview=[check for check in checks if check not in never],
        sections=[check for check in by_urgency if check not in never],
        never=never,
        style=Markup((beside / "report.css").read_text("utf-8")),
        viewer=ViewerParts(Markup(parts.style), Markup(parts.script)),
        counted=counted,
        error_change=_error_change,
        run_time=_run_time,
        real_time_factor=_real_time_factor,
        readable_time=_readable_time,
        map_viewer=lambda name: _map_viewer(folder / name),
        has_history=_has_history,
        history=lambda check: Markup(history_svg(check)),
        bound_text=_bound_text,
        published_errors=_published_errors,
    )
    return printable(page).encode()


def _error_change(check: CheckResult) -> float | None:
    """The change of the error since the previous run, in per cent."""
    errors, before = check.errors, MeasuredErrors.of(check.previous)
    if errors is None or before is None or before.measure != errors.measure or before.metres == 0:
        return None
    return 100 * (errors.metres - before.metres) / before.metres


def _run_time(check: CheckResult) -> str:
    """How long the run took; empty if kernels were compiled during it."""
    took = None if check.last is None else check.last["times"]["seconds"]
    return "" if took is None else f"{took:.1f} s"


def _real_time_factor(check: CheckResult) -> str:
    """The duration of the log divided by that of the run."""
    if not _run_time(check) or check.last is None or not check.last["counts"]["duration"]:
        return ""
    return f"{check.last['counts']['duration'] / max(check.last['times']['seconds'], 0.001):.0f} ×"


def _readable_time(when: str) -> str:
    return when.replace("T", " ").replace("Z", " UTC")


def _map_viewer(results: Path) -> Markup | None:
    from markupsafe import Markup

    try:
        return Markup((results / "viewer.html").read_text("utf-8"))
    except OSError:
        return None


def _has_history(check: CheckResult) -> bool:
    return any(run["outcome"] != "done" or MeasuredErrors.of(run) is not None for run in check.runs)


def _bound_text(entry: ManifestEntry) -> str:
    bounds = ((entry.max_translation, " m"), (entry.max_rotation, "°"))
    return ", ".join(f"{bound:g}{unit}" for bound, unit in bounds if bound is not None) or "none"


def _published_errors(check: CheckResult) -> list[tuple[float, str, str, bool]]:
    """Error (m), sort key, method and whether it is ours, the smallest error first."""
    assert check.errors is not None
    theirs = [(error, "theirs", method, False) for method, error in check.entry.published.items()]
    return sorted([(check.errors.metres, "", "this run", True), *theirs])
