"""The report's section on a log: its map, its errors beside published ones, and its history."""

from __future__ import annotations

import base64
import re
from html import escape
from pathlib import Path

from nscan_cli.nightly.history_plot import history_svg
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.regression_check import CheckResult, MeasuredErrors, Status

STATUS_SYMBOLS: dict[Status, str] = {"good": "✓", "worse": "!", "above": "✗", "failed": "✗", "absent": "–"}
STATUS_WORDS: dict[Status, str] = {
    "good": "good",
    "worse": "worse",
    "above": "above bound",
    "failed": "failed",
    "absent": "not there",
}


def log_section(check: CheckResult, folder: Path) -> str:
    """The section on a log; the map preview is read from the log's results in `folder`."""
    entry, last = check.entry, check.last
    parts = [
        f'<section class="log {check.status}" id="{entry.name}">',
        f"<header><h2>{entry.name}</h2>{status_badge(check)}</header>",
    ]
    if check.status != "good":
        parts += [f'<p class="reason">{escape(reason)}</p>' for reason in check.reasons]
    if entry.about:
        parts.append(f'<p class="about">{escape(entry.about)}</p>')
    if check.status == "absent" and "log" in entry.sources:
        parts.append(f"<p>Download: {_source_link(entry)}</p>")
    if last is not None and check.status in ("failed", "absent"):
        parts.append('<p class="about">Below: the last run that did not fail.</p>')
    if last is not None:
        parts += [
            '<div class="body"><div>',
            *_map(check, folder),
            *_history(check),
            '</div><div class="facts">',
        ]
        parts += [*_error_table(check), *_published_bars(check), *_run_table(check), "</div></div>"]
    elif len(check.runs) > 1:
        parts += _history(check)
    return "\n".join([*parts, "</section>"])


def status_badge(check: CheckResult) -> str:
    """The status of the log in a word or two."""
    if check.status == "good" and not check.is_within_bounds:
        words = "not measured" if check.errors is None else "no bound"
        return f'<span class="chip absent">{words}</span>'
    return f'<span class="chip {check.status}">{STATUS_WORDS[check.status]}</span>'


def absent_section(checks: list[CheckResult]) -> list[str]:
    """The logs that are missing and were never run, with where to download them."""
    if not checks:
        return []
    rows = []
    for check in checks:
        entry = check.entry
        about = escape(entry.about)
        source = ("<br>" if about else "") + _source_link(entry) if "log" in entry.sources else ""
        rows.append(f'<dt id="{entry.name}">{entry.name}</dt><dd>{about}{source}</dd>')
    title = "One more log is" if len(rows) == 1 else f"{len(rows)} more logs are"
    return [
        f'<section class="log missing"><h2>{title} not there</h2>',
        f"<dl>{''.join(rows)}</dl>",
        "</section>",
    ]


def error_change(check: CheckResult) -> str:
    """The change of the error since the previous run, in per cent."""
    errors, before = check.errors, MeasuredErrors.of(check.previous)
    if errors is None or before is None or before.measure != errors.measure or before.metres == 0:
        return ""
    percent = 100 * (errors.metres - before.metres) / before.metres
    if abs(percent) < 0.05:
        return "±0 %"
    tone = "poorer" if percent > 0 else "better"
    return f'<span class="{tone}">{"+" if percent > 0 else "−"}{abs(percent):.1f} %</span>'


def run_time(check: CheckResult) -> str:
    """How long the run took; empty if kernels were compiled during it."""
    took = None if check.last is None else check.last["times"]["seconds"]
    return "" if took is None else f"{took:.1f} s"


def real_time_factor(check: CheckResult) -> str:
    """The duration of the log divided by that of the run."""
    if not run_time(check) or check.last is None or not check.last["counts"]["duration"]:
        return ""
    return f"{check.last['counts']['duration'] / max(check.last['times']['seconds'], 0.001):.0f} ×"


def time_span(text: str) -> str:
    """The text in an element of the class for what differs between two runs on the same inputs."""
    return f'<span class="time">{text}</span>'


def _map(check: CheckResult, folder: Path) -> list[str]:
    """The map preview with its layers; a remark if the files are missing."""
    name = check.entry.name
    try:
        picture = base64.b64encode((folder / name / "preview.png").read_bytes()).decode()
        layers = (folder / name / "preview.svg").read_text("utf-8")
    except OSError:
        return ['<p class="soft">The files of the map are missing.</p>']
    switches = "".join(
        f'<label><input type="checkbox" data-layer="{layer}"{checked}>'
        f'<span class="key" style="border-color:var(--{layer})">{text}</span></label>'
        for layer, text, checked in (
            ("path", "path", " checked"),
            ("loops", "loops", " checked"),
            ("refused", "refused loops", ""),
        )
    )
    published = check.entry.published_map
    theirs = f'<a href="{_link(published)}">published map</a>' if published else ""
    return [
        '<div class="map">',
        f'<div class="frame"><div class="sheet" style="--aspect:{_aspect(layers):.4f}">'
        f'<img alt="Map of {name}" src="data:image/png;base64,{picture}">',
        layers + "</div></div>",
        '<div class="tools">'
        '<span><button type="button" data-zoom="2" aria-label="larger">+</button> '
        '<button type="button" data-zoom="0.5" aria-label="smaller">−</button> '
        '<button type="button" data-zoom="0">fit</button></span>'
        f'{switches}<a href="{name}/map.png">full size</a>{theirs}</div>',
        "</div>",
    ]


def _aspect(layers: str) -> float:
    """Width divided by height of a preview, from the size in its SVG."""
    size = re.search(r'viewBox="0 0 (\d+) (\d+)"', layers)
    return 1.0 if size is None else int(size[1]) / int(size[2])


def _history(check: CheckResult) -> list[str]:
    """The plot of the errors by run; empty if nothing was measured and no run failed."""
    if all(run["outcome"] == "done" and MeasuredErrors.of(run) is None for run in check.runs):
        return []
    return ["<h3>History</h3>", f'<div class="history">{history_svg(check)}</div>']


def _error_table(check: CheckResult) -> list[str]:
    errors, entry = check.errors, check.entry
    if errors is None:
        return ['<p class="soft">No errors: the manifest names no relations and no reference.</p>']
    metres, degrees = errors.translation, errors.rotation
    changed = error_change(check)
    rows = [
        ("mean ± sd", f"{metres['mean']:.4f} ± {metres['sd']:.4f} m"),
        ("median, maximum", f"{metres['median']:.4f}, {metres['max']:.3f} m"),
        ("rotation", f"{degrees['mean']:.3f} ± {degrees['sd']:.3f}°"),
        ("bound", _bound(entry.max_translation, entry.max_rotation)),
        ("change", changed or "first run"),
    ]
    return [
        f"<h3>Error, {errors.measure}</h3>",
        f'<p class="big number">{errors.metres:.4f} m</p>',
        _definition_list(rows),
    ]


def _bound(translation: float | None, rotation: float | None) -> str:
    parts = [] if translation is None else [f"{translation:g} m"]
    return ", ".join(parts if rotation is None else [*parts, f"{rotation:g}°"]) or "none"


def _published_bars(check: CheckResult) -> list[str]:
    """Bars of this run's error and of the published ones, the smallest first."""
    errors = check.errors
    if errors is None or not check.entry.published:
        return []
    bars = sorted([(errors.metres, "", "this run"), *((error, "theirs", method) for method, error
                  in check.entry.published.items())])  # fmt: skip
    longest = max(bars[-1][0], 1e-9)
    cells = []
    for error, kind, method in bars:
        tone = ' class="ours"' if kind == "" else ""
        cells.append(
            f'<span{tone}>{escape(method)}</span><i{tone} style="width:{100 * error / longest:.1f}%"></i>'
            f'<span class="number{"" if kind else " ours"}">{error:.4f}</span>'
        )
    return ["<h3>Published errors, m</h3>", f'<div class="bars">{"".join(cells)}</div>']


def _run_table(check: CheckResult) -> list[str]:
    assert check.last is not None
    counts = check.last["counts"]
    rows = [
        ("scans, keyframes", f"{counts['scans']:,}, {counts['keyframes']:,}"),
        ("relations", f"{counts['pairwise']:,} pairwise, {counts['nscan']:,} nScan"),
        ("loops", f"{counts['loops']['accepted']:,} accepted, {counts['loops']['refused']:,} refused"),
        ("time", _time_row(check)),
        ("finished", _finish_and_reasons(check)),
    ]
    notes = [f'<p class="note">{escape(note)}</p>' for note in check.notes]
    return ["<h3>Run</h3>", _definition_list(rows), *notes]


def _time_row(check: CheckResult) -> str:
    took, faster = run_time(check), real_time_factor(check)
    if not took:
        return time_span("not timed: kernels were compiled during the run")
    return time_span(f"{took}, {faster} real time" if faster else took)


def _finish_and_reasons(check: CheckResult) -> str:
    """When the run was finished, and why the log was run again."""
    assert check.last is not None
    times = check.last["times"]
    why = "; ".join(times.get("anew", []))
    return time_span(readable_time(times["finished"]) + (f"; run again: {escape(why)}" if why else ""))


def readable_time(when: str) -> str:
    """A time in ISO 8601 (UTC) as people write it."""
    return when.replace("T", " ").replace("Z", " UTC")


def _definition_list(rows: list[tuple[str, str]]) -> str:
    cells = "".join(f'<dt>{name}</dt><dd class="number">{value}</dd>' for name, value in rows)
    return f"<dl>{cells}</dl>"


def _source_link(entry: ManifestEntry) -> str:
    source = entry.sources["log"]
    return f'<a href="{_link(source)}">{escape(source)}</a>'


def _link(source: str) -> str:
    """The address if it is one of the web, else none: a manifest may come from anybody."""
    return escape(source) if source.startswith(("https://", "http://")) else "#"
