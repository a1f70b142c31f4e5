"""The summary of a command as a table for a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from nscan_cli.files.text import counted

TERMINAL_WIDTH = 80
Row = tuple[str, Sequence[str]]
"""A title, and the lines beside it. A row without lines is left out."""


def summary_table(rows: Sequence[Row], width: int | None = TERMINAL_WIDTH) -> str:
    """The rows, with titles in the first column. Lines are wrapped at `width`, None for not at all."""
    filled = [(title, lines) for title, lines in rows if lines]
    aside = max(len(title) for title, _lines in filled) + 2
    shown = []
    for title, lines in filled:
        if width is not None:
            broken = textwrap.TextWrapper(width - aside, break_long_words=False, break_on_hyphens=False)
            lines = [part for line in lines for part in broken.wrap(line)]
        for line in lines:
            shown.append(f"{title:{aside}}{line}")
            title = ""
    return "\n".join(shown)


def match_outcome(reason: str | None, iterations: int, evaluations: int, unsettled: int) -> list[str]:
    """The outcome of a match: converged or why not, iterations, and stages that did not settle."""
    outcome = "converged" if reason is None else f"not converged ({reason})"
    cut = f"{counted(unsettled, 'stage')} before the last did not converge: the result is less certain"
    return [
        f"{outcome}, {counted(iterations, 'iteration')}, {counted(evaluations, 'evaluation')}",
        *([cut] if unsettled else []),
    ]
