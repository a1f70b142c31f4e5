"""How a message names stretches of a log."""

from __future__ import annotations

from collections.abc import Iterable

from nscan_cli.files.text import counted

MOST_STRETCHES_NAMED = 5
"""Stretches that a message names; the others are counted."""


def stretch_names(stretches: Iterable[tuple[int, int]]) -> str:
    """Names of stretches, given by the numbers of their first and last scans."""
    names = [f"{first} to {last}" for first, last in stretches]
    others = len(names) - MOST_STRETCHES_NAMED
    more = f" and {counted(others, 'more stretch')}" if others > 0 else ""
    return ", ".join(names[:MOST_STRETCHES_NAMED]) + more
