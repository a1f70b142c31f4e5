"""The summary of `slam`: as a table for people, and as an object for `--json`."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, Any

from nscan_cli.cli.summary import Row, summary_table
from nscan_cli.files.text import counted

if TYPE_CHECKING:
    from nscan_cli.graph.model import Graph

Facts = dict[str, Any]


def graph_facts(graph: Graph) -> Facts:
    """The facts that any graph has, in m; a run adds those of its mode, and how long it took."""
    from nscan_cli.slam.log_to_graph import GraphCounts

    counts = GraphCounts.of(graph)
    reasons: Counter[str] = Counter()
    for reason, count in counts.refused.items():
        reasons[without_numbers(reason)] += count
    return {
        "scans": len(graph),
        "duration": None,
        "keyframes": counts.keyframes,
        "pairwise": counts.pairwise,
        "nscan": counts.nscan,
        "loops": {
            "tried": counts.accepted + counts.refused.total(),
            "accepted": counts.accepted,
            "refused": counts.refused.total(),
            "reasons": dict(reasons.most_common()),
        },
        "sigma": _sigma(graph),
        "tracking": None,
        "optimised": None,
        "verification": None,
        "warnings": [],
    }


def _sigma(graph: Graph) -> Facts:
    """Standard deviations (m) of the keyframes' positions, each along its least certain direction."""
    import numpy as np

    first = int(graph.keyframes[0])
    known = {keyframe: covariance for keyframe, covariance in graph.marginals.items() if keyframe != first}
    median = largest = worst = None
    if known:
        positions = np.stack([covariance[:2, :2] for covariance in known.values()])
        sigmas = np.sqrt(np.maximum(np.linalg.eigvalsh(positions)[:, 1], 0.0))
        median, largest = float(np.median(sigmas)), float(sigmas.max())
        worst = int(graph.scans[list(known)[int(np.argmax(sigmas))]])
    return {
        "median": median,
        "max": largest,
        "scan": worst,
        "from_scan": int(graph.scans[first]),
        "unknown": len(graph.keyframes) - 1 - len(known),
    }


def without_numbers(reason: str) -> str:
    """The reason without its numbers of scans, so that equal reasons are counted together."""
    reason = re.sub(r"\d+ of \d+ scans", "some of the scans", reason)
    return re.sub(r"(all )?\d+ scans?\b", "some scans", reason)


def facts_lines(facts: Facts, verbose: bool) -> str:
    """The facts as a table; `verbose` adds what tracking did."""
    loops, tracking, optimised = facts["loops"], facts["tracking"], facts["optimised"]
    tried = f"{loops['tried']} tried, {loops['accepted']} accepted, {loops['refused']} refused"
    rows: list[Row] = [
        ("scans", [] if facts["duration"] is None else [f"{facts['scans']} in {facts['duration']:.1f} s"]),
        ("keyframes", [f"{facts['keyframes']}"]),
        ("relations", [f"{facts['pairwise']} pairwise, {facts['nscan']} nScan"]),
        ("loops", [tried if loops["tried"] else "none tried"]),
        ("refused", [f"{count}: {reason}" for reason, count in loops["reasons"].items()]),
        ("uncertainty", _sigma_lines(facts["sigma"])),
    ]
    if tracking is not None and verbose:
        starts, searches = counted(tracking["restarts"], "start"), counted(tracking["searches"], "search")
        places = counted(tracking["places"], "keyframe")
        rows += [
            ("tracking", [f"{starts} from other angles, {searches}"]),
            ("large loops", [f"{places} found by search at a place seen before"]),
        ]
    if optimised is not None:
        refined = ", then refined" if optimised["refined"] else ""
        iterations = counted(optimised["iterations"], "iteration")
        rows += [
            ("optimised", [f"energy {optimised['energy']:.6g} after {iterations}{refined}"]),
            ("moved", [f"poses by at most {optimised['moved']:.3g} m"]),
        ]
    if facts["verification"] is not None:
        rows += [("mapped again", verification_lines(facts["verification"]))]
    return summary_table([*rows, ("time", [_time(facts)]), ("written", [", ".join(facts["written"])])])


def _sigma_lines(sigma: Facts) -> list[str]:
    lines = []
    if sigma["median"] is not None:
        lines.append(
            f"median {sigma['median']:.2g} m, worst {sigma['max']:.2g} m (scan {sigma['scan']}), "
            f"relative to scan {sigma['from_scan']}"
        )
    if sigma["unknown"]:
        lines.append(f"unknown for {counted(sigma['unknown'], 'keyframe')}")
    return lines


def verification_lines(verification: Facts) -> list[str]:
    """Each run that had to give the same map, and where it differs most."""
    lines = []
    for repeat in verification["repeats"]:
        found = repeat["differences"]
        if not found:
            lines.append(f"{repeat['change']}: no way could be compared")
            continue
        worst = max(found, key=lambda each: each["max"])
        sizes = ", ".join(f"{each['max']:.3f}" for each in found)
        ways = ", ".join(f"{each['way']:g}" for each in found)
        sigma = "unknown" if worst["sigma"] is None else f"{worst['sigma']:.3f} m"
        told = "" if repeat["counts"] else "; it says itself that it is wrong"
        lines.append(
            f"{repeat['change']}: at most {sizes} m apart over {ways} m, most from scan {worst['first']} to "
            f"{worst['last']} (sigma {sigma}){told}"
        )
    return lines


def _time(facts: Facts) -> str:
    """How long the run took, and its speed if it mapped a log without compiling."""
    seconds, duration = facts["seconds"], facts["duration"]
    if facts["compiled"]:
        return f"{seconds:.1f} s, including the compilation of kernels"
    if duration is None:
        return f"{seconds:.1f} s"
    speed = f"{facts['scans'] / seconds:.0f} scans a second, {duration / seconds:.0f} times real time"
    return f"{seconds:.1f} s, {speed}"
