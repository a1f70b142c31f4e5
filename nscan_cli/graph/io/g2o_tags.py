"""The tags of g2o files that are not read, and what is lost without them."""

from __future__ import annotations

import re
from collections.abc import Mapping

from nscan_cli.files.text import counted

LANDMARKS = "XY|POINT|LANDMARK|LINE|SEGMENT|PLANE|BEARING"
LOSSES = (
    ("SWITCH", "edges that can be switched off are not read, so these loops are not closed"),
    ("MIXTURE|MAXMIX", "edges with several alternatives are not read, so what they join may come apart"),
    ("PRIOR|GPS|GNSS|UTM", "priors on poses are not read, so the graph's frame is free, and its shape is "
     "that of the edges between poses"),
    (f"VERTEX.*({LANDMARKS})", "landmarks are not read"),
    (f"^(LANDMARK|BR)$|EDGE.*({LANDMARKS})", "observations of landmarks are not read, so the poses are held "
     "by the edges between poses alone"),
    ("ROBUST", "edges with robust kernels are not read, so what they join may come apart"),
    ("OFFSET|CALIB|PARAMS|CAMERA", "offsets and calibrations of sensors are not read, nor edges that need "
     "them"),
    ("VERTEX_?(SE3|3|SIM3)|EDGE_?(SE3|3|SIM3)", "of graphs in space only planar VERTEX_SE3:QUAT and "
     "EDGE_SE3:QUAT are read"),
    ("^VERTEX", "vertices of this kind are not read"),
    ("^(EDGE|ODOMETRY|EQUIV)", "edges of this kind are not read, so what they join may come apart"),
    ("LASER|TAG|IMU|IMAGE", "what sensors saw is not read from a graph"),
    ("", "this tag is not known, and what it says is lost"),
)  # fmt: skip
"""Pattern of tags, and what is lost; the first pattern that matches a tag counts."""
NAMED_TAGS = 5
"""Largest number of tags that one sentence names."""
SHOWN_TAG_LENGTH = 40
"""Characters of a tag that are shown."""


def loss_messages(skipped: Mapping[str, int]) -> list[str]:
    """A sentence for each kind of loss, with the number of skipped lines by tag."""
    kinds: dict[str, list[str]] = {}
    for tag, count in skipped.items():
        lost = next(lost for pattern, lost in LOSSES if re.search(pattern, tag))
        name = tag if re.fullmatch("[!-~]+", tag) else ascii(tag)
        kinds.setdefault(lost, []).append(counted(count, f"{name[:SHOWN_TAG_LENGTH]} line"))
    sentences = []
    for lost, lines in kinds.items():
        if len(lines) > NAMED_TAGS:
            lines[NAMED_TAGS:] = [f"lines of {counted(len(lines) - NAMED_TAGS, 'other tag')}"]
        *before, last = lines
        listed = f"{', '.join(before)} and {last}" if before else last
        sentences.append(f"{listed} skipped: {lost}")
    return sentences
