"""The errors of a log's runs as a small plot (SVG)."""

from __future__ import annotations

from html import escape

from nscan_cli.nightly.regression_check import CheckResult, MeasuredErrors

WIDTH, HEIGHT = 340, 96
LEFT, RIGHT, TOP, BOTTOM = 50, 10, 8, 18
MAX_RUNS = 40
"""Number of the last runs that are drawn."""


def history_svg(check: CheckResult) -> str:
    """The error of each run, the bound as a dashed line, a cross for each failed run."""
    runs = check.runs[-MAX_RUNS:]
    errors = [MeasuredErrors.of(run) for run in runs]
    figures = [None if error is None else error.metres for error in errors]
    bound = check.entry.max_translation
    known = [figure for figure in figures if figure is not None]
    greatest = max([*known, bound or 0.0], default=0.0) * 1.15 or 1.0
    step = (WIDTH - LEFT - RIGHT) / max(1, len(runs) - 1)

    def x(run: int) -> float:
        return LEFT + run * step if len(runs) > 1 else (LEFT + WIDTH - RIGHT) / 2

    def y(figure: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * figure / greatest

    marks = [f'<line class="axis" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(0):.1f}" y2="{y(0):.1f}"/>']
    if bound is not None and known:
        marks.append(f'<line class="bound" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(bound):.1f}" '
                     f'y2="{y(bound):.1f}"/>')  # fmt: skip
        marks.append(_text_svg(LEFT - 6, y(bound) + 4, f"{bound:g}"))
    if known:
        marks.append(_text_svg(LEFT - 6, y(0) + 4, "0 m"))
    corners = [f"{x(at):.1f},{y(figure):.1f}" for at, figure in enumerate(figures) if figure is not None]
    marks.append(f'<polyline class="run" points="{" ".join(corners)}"/>')
    for at, (run, figure) in enumerate(zip(runs, figures, strict=True)):
        tool = escape(run["tool"])
        if run["outcome"] != "done":
            a, b, c = x(at), HEIGHT - BOTTOM, 4
            marks.append(f'<path class="fail" d="M{a - c:.1f} {b - c}l8 8m-8 0l8 -8">'
                         f"<title>failed: {escape(run['reason'])}; {tool}</title></path>")  # fmt: skip
        elif figure is not None:
            radius = 3.5 if at == len(runs) - 1 else 2
            marks.append(f'<circle class="dot" cx="{x(at):.1f}" cy="{y(figure):.1f}" r="{radius}">'
                         f"<title>{figure:.4f} m; {tool}</title></circle>")  # fmt: skip
    count = "one run so far" if len(check.runs) == 1 else f"{len(check.runs)} runs"
    marks.append(_text_svg(WIDTH - RIGHT, HEIGHT - 3, count))
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="Errors by run">{"".join(marks)}</svg>'


def _text_svg(x: float, y: float, text: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="end">{text}</text>'
