"""The summary of a command as a table for a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from nscan_cli.files.text import counted

TERMINAL_WIDTH = 80
Row = tuple[str, Sequence[str]]
"""A title, and the lines beside it. A row without lines is left out."""


def summary_table(rows: Sequence[Row]) -> str:
    """The rows, with titles in the first column."""
    filled = [(title, lines) for title, lines in rows if lines]
    aside = max(len(title) for title, _lines in filled) + 2
    broken = textwrap.TextWrapper(TERMINAL_WIDTH - aside, break_long_words=False, break_on_hyphens=False)
    shown = []
    for title, lines in filled:
        for part in (part for line in lines for part in broken.wrap(line)):
            shown.append(f"{title:{aside}}{part}")
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
