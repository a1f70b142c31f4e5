"""How a message names stretches of a log."""

from __future__ import annotations

from collections.abc import Iterable

from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import LaserLog

MOST_STRETCHES_NAMED = 5
"""Stretches that a message names; the others are counted."""


def named_stretches(log: LaserLog, stretches: Iterable[tuple[int, int]]) -> str:
    """The scan numbers with which stretches, given by their first and last rows, begin and end."""
    names = [f"{log.numbers[first]} to {log.numbers[last]}" for first, last in stretches]
    others = len(names) - MOST_STRETCHES_NAMED
    more = f" and {counted(others, 'more stretch')}" if others > 0 else ""
    return ", ".join(names[:MOST_STRETCHES_NAMED]) + more
