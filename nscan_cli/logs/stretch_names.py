"""How a message names stretches of a log."""

from __future__ import annotations

from collections.abc import Iterable

from nscan_cli.files.text import shortened_list


def stretch_names(stretches: Iterable[tuple[int, int]]) -> str:
    """Names of stretches, given by the numbers of their first and last scans."""
    names = [f"{first} to {last}" for first, last in stretches]
    return shortened_list(names, "more stretch")
