"""The places in the map that a notice is about: the stretches of the path that it names by their scans."""

from __future__ import annotations

import re

import numpy as np

from nscan_cli.poses import Indices

Stretch = tuple[int, int]
"""The first and the last node."""

NAMED = re.compile(r"\bscans? (\d+(?:, \d+)*)(?: (?:to|and) (?:scan )?(\d+)(?! more))?")
"""As in "scan 7", "scans 7, 12 and 3 more", "scans 7 to 12", "from scan 7 to scan 12"."""


def notice_places(notice: str, scans: Indices) -> list[Stretch]:
    """The stretches of nodes whose scan numbers (N,), increasing, a notice names.

    A scan that the graph does not have is represented by the one that follows.
    """
    found: list[Stretch] = []
    for match in NAMED.finditer(notice):
        *firsts, last = (int(number) for number in match[1].split(", "))
        found += [(_node(scans, number), _node(scans, number)) for number in firsts]
        end = last if match[2] is None or " and " in match[0] else int(match[2])
        found.append((_node(scans, last), max(_node(scans, last), _node(scans, end))))
        if " and " in match[0]:
            found.append((_node(scans, int(match[2])), _node(scans, int(match[2]))))
    return found


def _node(scans: Indices, number: int) -> int:
    """The node of a scan number."""
    return min(int(np.searchsorted(scans, number)), len(scans) - 1)
