"""The report's card of a log: its map, its errors beside the published ones, and how it went before."""

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


def log_section(verdict: CheckResult, folder: Path) -> str:
    """The card; map and layers are taken from the log's results in `folder`."""
    entry, last = verdict.entry, verdict.last
    parts = [
        f'<section class="log {verdict.status}" id="{entry.name}">',
        f"<header><h2>{entry.name}</h2>{status_badge(verdict)}</header>",
    ]
    if verdict.status != "good":
        parts += [f'<p class="reason">{escape(reason)}</p>' for reason in verdict.reasons]
    if entry.about:
        parts.append(f'<p class="about">{escape(entry.about)}</p>')
    if verdict.status == "absent" and "log" in entry.sources:
        parts.append(f"<p>To be had from {_source_link(entry)}</p>")
    if last is not None and verdict.status in ("failed", "absent"):
        parts.append('<p class="about">Below: the last night that was done.</p>')
    if last is not None:
        parts += [
            '<div class="body"><div>',
            *_map(verdict, folder),
            *_history(verdict),
            '</div><div class="facts">',
        ]
        parts += [*_error_table(verdict), *_published_bars(verdict), *_run_table(verdict), "</div></div>"]
    elif len(verdict.nights) > 1:
        parts += _history(verdict)
    return "\n".join([*parts, "</section>"])


def status_badge(verdict: CheckResult) -> str:
    """What is to be said of the log in a word or two."""
    if verdict.status == "good" and not verdict.is_within_bounds:
        words = "not measured" if verdict.errors is None else "no bound"
        return f'<span class="chip absent">{words}</span>'
    return f'<span class="chip {verdict.status}">{STATUS_WORDS[verdict.status]}</span>'


def absent_section(verdicts: list[CheckResult]) -> list[str]:
    """What is not there and never was, in few words, with the places to get it from."""
    if not verdicts:
        return []
    rows = []
    for verdict in verdicts:
        entry = verdict.entry
        about = escape(entry.about)
        source = ("<br>" if about else "") + _source_link(entry) if "log" in entry.sources else ""
        rows.append(f'<dt id="{entry.name}">{entry.name}</dt><dd>{about}{source}</dd>')
    title = "One more log is" if len(rows) == 1 else f"{len(rows)} more logs are"
    return [
        f'<section class="log missing"><h2>{title} not there</h2>',
        f"<dl>{''.join(rows)}</dl>",
        "</section>",
    ]


def error_change(verdict: CheckResult) -> str:
    """By how much the error has changed since the night before, in per cent."""
    errors, before = verdict.errors, MeasuredErrors.of(verdict.before)
    if errors is None or before is None or before.what != errors.what or before.metres == 0:
        return ""
    percent = 100 * (errors.metres - before.metres) / before.metres
    if abs(percent) < 0.05:
        return "±0 %"
    tone = "poorer" if percent > 0 else "better"
    return f'<span class="{tone}">{"+" if percent > 0 else "−"}{abs(percent):.1f} %</span>'


def run_time(verdict: CheckResult) -> str:
    """How long the log took; nothing where kernels were compiled meanwhile."""
    took = None if verdict.last is None else verdict.last["times"]["seconds"]
    return "" if took is None else f"{took:.1f} s"


def real_time_factor(verdict: CheckResult) -> str:
    """How much faster than it was recorded."""
    if not run_time(verdict) or verdict.last is None or not verdict.last["counts"]["duration"]:
        return ""
    return f"{verdict.last['counts']['duration'] / max(verdict.last['times']['seconds'], 0.001):.0f} ×"


def time_span(text: str) -> str:
    """In an element of the class that has all that differs from call to call."""
    return f'<span class="time">{text}</span>'


def _map(verdict: CheckResult, folder: Path) -> list[str]:
    """The map with its layers; nothing where the files are gone."""
    name = verdict.entry.name
    try:
        picture = base64.b64encode((folder / name / "preview.png").read_bytes()).decode()
        layers = (folder / name / "preview.svg").read_text("utf-8")
    except OSError:
        return ['<p class="soft">The map is gone.</p>']
    switches = "".join(
        f'<label><input type="checkbox" data-layer="{layer}"{checked}>'
        f'<span class="key" style="border-color:var(--{layer})">{text}</span></label>'
        for layer, text, checked in (
            ("path", "path", " checked"),
            ("loops", "loops", " checked"),
            ("refused", "refused loops", ""),
        )
    )
    published = verdict.entry.published_map
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
    """Width by height of a preview, whose SVG says its size."""
    size = re.search(r'viewBox="0 0 (\d+) (\d+)"', layers)
    return 1.0 if size is None else int(size[1]) / int(size[2])


def _history(verdict: CheckResult) -> list[str]:
    """The plot, where there is something to plot."""
    if all(night["outcome"] == "done" and MeasuredErrors.of(night) is None for night in verdict.nights):
        return []
    return ["<h3>Nights</h3>", f'<div class="nights">{history_svg(verdict)}</div>']


def _error_table(verdict: CheckResult) -> list[str]:
    errors, entry = verdict.errors, verdict.entry
    if errors is None:
        return ['<p class="soft">There is nothing to measure it against.</p>']
    metres, degrees = errors.translation, errors.rotation
    changed = error_change(verdict)
    rows = [
        ("mean ± sd", f"{metres['mean']:.4f} ± {metres['sd']:.4f} m"),
        ("median, greatest", f"{metres['median']:.4f}, {metres['max']:.3f} m"),
        ("rotation", f"{degrees['mean']:.3f} ± {degrees['sd']:.3f}°"),
        ("bound", _bound(entry.max_translation, entry.max_rotation)),
        ("change", changed or "first night"),
    ]
    return [
        f"<h3>Error, {errors.what}</h3>",
        f'<p class="big number">{errors.metres:.4f} m</p>',
        _definition_list(rows),
    ]


def _bound(translation: float | None, rotation: float | None) -> str:
    parts = [] if translation is None else [f"{translation:g} m"]
    return ", ".join(parts if rotation is None else [*parts, f"{rotation:g}°"]) or "none"


def _published_bars(verdict: CheckResult) -> list[str]:
    """Ours and the published errors, the least first."""
    errors = verdict.errors
    if errors is None or not verdict.entry.published:
        return []
    bars = sorted([(errors.metres, "", "this run"), *((error, "theirs", method) for method, error
                  in verdict.entry.published.items())])  # fmt: skip
    longest = max(bars[-1][0], 1e-9)
    cells = []
    for error, kind, method in bars:
        tone = ' class="ours"' if kind == "" else ""
        cells.append(
            f'<span{tone}>{escape(method)}</span><i{tone} style="width:{100 * error / longest:.1f}%"></i>'
            f'<span class="number{"" if kind else " ours"}">{error:.4f}</span>'
        )
    return ["<h3>Beside the published errors, m</h3>", f'<div class="bars">{"".join(cells)}</div>']


def _run_table(verdict: CheckResult) -> list[str]:
    assert verdict.last is not None
    counts = verdict.last["counts"]
    rows = [
        ("scans, keyframes", f"{counts['scans']:,}, {counts['keyframes']:,}"),
        ("relations", f"{counts['pairwise']:,} pairwise, {counts['nscan']:,} nScan"),
        ("loops", f"{counts['loops']['accepted']:,} accepted, {counts['loops']['refused']:,} refused"),
        ("time", _time_row(verdict)),
        ("made", _finish_and_reasons(verdict)),
    ]
    notes = [f'<p class="note">{escape(note)}</p>' for note in verdict.notes]
    return ["<h3>Run</h3>", _definition_list(rows), *notes]


def _time_row(verdict: CheckResult) -> str:
    took, faster = run_time(verdict), real_time_factor(verdict)
    if not took:
        return time_span("not timed: kernels were compiled meanwhile")
    return time_span(f"{took}, {faster} real time" if faster else took)


def _finish_and_reasons(verdict: CheckResult) -> str:
    """When, and why it was done although it was done before."""
    assert verdict.last is not None
    times = verdict.last["times"]
    why = "; ".join(times.get("anew", []))
    anew = f", anew: {escape(why)}" if why else ""
    return time_span(f"{readable_time(times['finished'])}{anew}")


def readable_time(when: str) -> str:
    """A time of ISO 8601 for people."""
    return when.replace("T", " ").replace("Z", " UTC")


def _definition_list(rows: list[tuple[str, str]]) -> str:
    cells = "".join(f'<dt>{name}</dt><dd class="number">{value}</dd>' for name, value in rows)
    return f"<dl>{cells}</dl>"


def _source_link(entry: ManifestEntry) -> str:
    source = entry.sources["log"]
    return f'<a href="{_link(source)}">{escape(source)}</a>'


def _link(source: str) -> str:
    """Only what leads to a page; a manifest may come from anybody."""
    return escape(source) if source.startswith(("https://", "http://")) else "#"
