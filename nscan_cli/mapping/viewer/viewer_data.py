"""The data of a viewer: one compressed block that unpack.js reads.

It is gzip of: the length of the header (4 bytes, little endian), the header in JSON, and the arrays that the
header lists by name, kind, place and length.
"""

from __future__ import annotations

import gzip
import json
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import counted
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.figures.graph_edges import edges_by_kind
from nscan_cli.poses import Array, Indices

MAX_BEAMS = 4_000_000
"""Beams in a page, which are about 3 MB. Of a longer log every nth scan is there."""
RANGE_UNIT = 0.01
"""The step of ranges in a page, m."""
COMPRESSION = 6
"""The level of zlib; a higher one takes three times as long, and makes the page smaller by 2 %."""
Stretch = tuple[int, int]
"""The first and the last node."""

NAMED = re.compile(r"\bscans? (\d+(?:, \d+)*)(?: (?:to|and) (?:scan )?(\d+)(?! more))?")
"""As in "scan 7", "scans 7, 12 and 3 more", "scans 7 to 12", "from scan 7 to scan 12"."""


def viewer_data(
    graph: Graph, bounds: tuple[float, float, float, float], scans: tuple[LaserLog, Indices, Indices] | None
) -> bytes:
    """The block for a graph over a picture of the map with `bounds` (m).

    `scans` are a log, the nodes (M,) that have a scan in it, and their rows (M,); None leaves scans out.
    """
    times = graph.times
    header: dict[str, Any] = {
        "bounds": bounds,
        "facts": _facts(graph),
        "loops": [
            {"nodes": loop.nodes, "accepted": loop.accepted, "reason": loop.reason, "score": loop.score}
            for loop in graph.loops
        ],
        "notices": [
            {"text": notice, "places": notice_places(notice, graph.scans)}
            for notice in graph.provenance.get("notices", [])
        ],
    }
    edges = edges_by_kind(graph)
    if not graph.loops:
        header["loops"] = [
            {"nodes": nodes, "accepted": True, "reason": "", "score": 0.0} for nodes in edges["loop"].tolist()
        ]
    arrays: dict[str, NDArray[Any]] = {
        "poses": graph.poses.astype("<f4"),
        "times": (times - times[0]).astype("<f4"),
        "numbers": graph.scans.astype("<i4"),
        "keyframes": graph.keyframes.astype("<i4"),
        "sigma": _sigma(graph).astype("<f4"),
        "nscan": edges["nScan"].astype("<i4"),
        "pairwise": edges["pairwise"].astype("<i4"),
    }
    header |= {"beams": 0, "unit": RANGE_UNIT, "mount": [0.0, 0.0, 0.0]}
    if scans is not None:
        log, nodes, rows = scans
        every = max(1, -(-len(rows) * log.ranges.shape[1] // MAX_BEAMS))
        nodes, rows = nodes[::every], rows[::every]
        header |= {"beams": log.ranges.shape[1], "mount": log.mount.tolist()}
        arrays |= {
            "scanNodes": nodes.astype("<i4"),
            "beamAngles": np.stack([log.angle_min, log.angle_increment], axis=1)[rows].astype("<f4"),
            "ranges": _coded_ranges(log.ranges[rows]),
        }
        if log.beam_times is not None:
            arrays["beamTimes"] = np.stack(log.beam_times, axis=1)[rows].astype("<f4")
    else:
        arrays["scanNodes"] = np.zeros(0, dtype="<i4")
    return _packed(header, arrays)


def _facts(graph: Graph) -> list[tuple[str, str]]:
    times, path = graph.times, float(np.hypot(*np.diff(graph.poses[:, :2], axis=0).T).sum())
    accepted = sum(loop.accepted for loop in graph.loops)
    inputs = [source["name"] for source in graph.provenance.get("inputs") or []]
    facts = [
        ("log", ", ".join(inputs[:3]) + (f" and {len(inputs) - 3} more" if len(inputs) > 3 else "")),
        ("scans", f"{len(graph):,} in {times[-1] - times[0]:,.1f} s"),
        ("path", f"{path:,.1f} m"),
        ("keyframes", f"{len(graph.keyframes):,}"),
        ("relations", f"{len(graph.pairwise):,} pairwise, {len(graph.nscan):,} nScan"),
        ("loops", f"{counted(len(graph.loops), 'candidate')}, {accepted:,} accepted"),
    ]
    return [(name, value) for name, value in facts if value]


def _sigma(graph: Graph) -> Array:
    """(K, 3) of every keyframe's position the standard deviations (m) along the long and the short axis of
    its ellipse, and the angle of the long one (rad); nan where they are unknown."""
    unknown = np.full((2, 2), np.nan)
    table = np.full((len(graph.keyframes), 3), np.nan)
    positions = np.array([graph.marginals.get(int(k), unknown)[:2, :2] for k in graph.keyframes])
    known = np.isfinite(positions).all(axis=(1, 2))
    if known.any():
        values, vectors = np.linalg.eigh(positions[known])
        axes = np.sqrt(np.maximum(values[:, ::-1], 0.0))
        table[known] = np.column_stack([axes, np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1])])
    return table


def _coded_ranges(ranges: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The ranges (M, B) as bytes: differences along the beams, low bytes first, then all high bytes.

    In units of RANGE_UNIT modulo 2¹⁶, with the sign in the lowest bit; 0 is no return.
    """
    units = np.where(np.isfinite(ranges), np.rint(ranges / RANGE_UNIT), 0.0)
    whole: NDArray[np.int32] = np.where(units < 2**16, units, 0.0).astype(np.int32)
    steps: NDArray[np.int32] = np.diff(whole, axis=1, prepend=np.int32(0))
    steps = (steps + 2**15) % 2**16 - 2**15
    coded = ((steps << 1) ^ (steps >> 31)).astype(np.uint16)
    return np.stack([coded & 0xFF, coded >> 8]).astype(np.uint8)


def _packed(header: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> bytes:
    """The block: header and arrays, compressed without a time stamp."""
    listed: list[tuple[str, str, int, int]] = []
    header = {**header, "arrays": listed}
    sizes = {name: -(-array.nbytes // 4) * 4 for name, array in arrays.items()}
    # Places count from the end of the header, whose length depends on them.
    place = 0
    for name, array in arrays.items():
        listed.append((name, array.dtype.str[1:], place, array.size))
        place += sizes[name]
    head = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 4)
    body = b"".join(array.tobytes().ljust(sizes[name], b"\0") for name, array in arrays.items())
    return gzip.compress(len(head).to_bytes(4, "little") + head + body, COMPRESSION, mtime=0)


def notice_places(notice: str, scans: Indices) -> list[Stretch]:
    """The stretches of nodes whose scan numbers (N,), increasing, a notice names.

    A scan that the graph does not have is represented by the one that follows.
    """
    found: list[Stretch] = []
    for match in NAMED.finditer(notice):
        texts, is_stretch = [*match[1].split(", "), *filter(None, match.groups()[1:])], " to " in match[0]
        nodes = [min(int(np.searchsorted(scans, int(text))), len(scans) - 1) for text in texts]
        found += [(node, node) for node in (nodes[:-2] if is_stretch else nodes)]
        if is_stretch:
            found.append((nodes[-2], max(nodes[-2:])))
    return found
