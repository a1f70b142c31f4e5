"""The result of an experiment: pictures, a table, and text about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image


@dataclass(frozen=True)
class Report:
    """One section of the document."""

    title: str
    text: str
    """Markdown: what was done, and what the pictures show."""
    pictures: Mapping[str, Image]
    """By the names of their files, without ending."""
    header: Sequence[str]
    """Of the table."""
    rows: Sequence[Sequence[str]]
    left_out: Sequence[str] = field(default_factory=tuple)
    """What could not be done, and why; whole sentences."""


def scan_names(which: Sequence[int]) -> str:
    """Scans counted from 1: "1, 2 and 3"."""
    *others, last = (str(scan + 1) for scan in which)
    return f"{', '.join(others)} and {last}"
