"""The errors of a log's nights as a small plot (SVG)."""

from __future__ import annotations

from html import escape

from nscan_cli.nightly.regression_check import CheckResult, MeasuredErrors

WIDTH, HEIGHT = 340, 96
LEFT, RIGHT, TOP, BOTTOM = 50, 10, 8, 18
MAX_RUNS = 40
"""As many of the last ones are drawn."""


def history_svg(verdict: CheckResult) -> str:
    """Error by night from 0 up, the bound as a dashed line, a cross for a night that failed."""
    nights = verdict.nights[-MAX_RUNS:]
    errors = [MeasuredErrors.of(night) for night in nights]
    figures = [None if error is None else error.metres for error in errors]
    bound = verdict.entry.max_translation
    known = [figure for figure in figures if figure is not None]
    greatest = max([*known, bound or 0.0], default=0.0) * 1.15 or 1.0
    step = (WIDTH - LEFT - RIGHT) / max(1, len(nights) - 1)

    def x(night: int) -> float:
        return LEFT + night * step if len(nights) > 1 else (LEFT + WIDTH - RIGHT) / 2

    def y(figure: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * figure / greatest

    marks = [f'<line class="axis" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(0):.1f}" y2="{y(0):.1f}"/>']
    if bound is not None and known:
        marks.append(f'<line class="bound" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(bound):.1f}" '
                     f'y2="{y(bound):.1f}"/>')  # fmt: skip
        marks.append(_text_svg(LEFT - 6, y(bound) + 4, f"{bound:g}", "end"))
    if known:
        marks.append(_text_svg(LEFT - 6, y(0) + 4, "0 m", "end"))
    corners = [f"{x(at):.1f},{y(figure):.1f}" for at, figure in enumerate(figures) if figure is not None]
    marks.append(f'<polyline class="run" points="{" ".join(corners)}"/>')
    for at, (night, figure) in enumerate(zip(nights, figures, strict=True)):
        tool = escape(night["tool"])
        if night["outcome"] != "done":
            a, b, c = x(at), HEIGHT - BOTTOM, 4
            marks.append(f'<path class="fail" d="M{a - c:.1f} {b - c}l8 8m-8 0l8 -8">'
                         f"<title>failed: {escape(night['reason'])}; {tool}</title></path>")  # fmt: skip
        elif figure is not None:
            radius = 3.5 if at == len(nights) - 1 else 2
            marks.append(f'<circle class="dot" cx="{x(at):.1f}" cy="{y(figure):.1f}" r="{radius}">'
                         f"<title>{figure:.4f} m; {tool}</title></circle>")  # fmt: skip
    count = "one night so far" if len(verdict.nights) == 1 else f"{len(verdict.nights)} nights"
    marks.append(_text_svg(WIDTH - RIGHT, HEIGHT - 3, count, "end"))
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="Errors by night">{"".join(marks)}</svg>'
    )


def _text_svg(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{text}</text>'
