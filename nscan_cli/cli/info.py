"""`nscan-cli info`: what is in a log, and what the other commands will use of it."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from nscan_cli.cli.command import log_argument, option, subcommand
from nscan_cli.cli.options import common_options, reading_options
from nscan_cli.cli.streams import answer
from nscan_cli.cli.summary import Row, table
from nscan_cli.counting import counted
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.outputs import write_whole
from nscan_cli.text import json_bytes

if TYPE_CHECKING:
    from nscan_cli.logs.scan import LaserLog


@subcommand(
    "info",
    ("nscan-cli info robot.log.gz", "what is in a log"),
    ("nscan-cli info --json robot.mcap | jq .scans", "one fact of it, for a script"),
)
@log_argument()
@option("--json", "as_json", is_flag=True, help="Print one JSON object (m, s, degrees).")
@reading_options
@common_options
def command(log: str, as_json: bool, reading: ReadingOptions, **_common: Any) -> None:
    """Tell what is in LOG, and what the other commands will use of it.

    These are scans, laser, mounting, odometry, what stands for no return, and what was skipped and why.
    The reading options change what the other commands see in the same way.
    """
    from nscan_cli.logs.load import read_log

    facts = facts_of(read_log(log, reading))
    if as_json:
        text = json.dumps(facts, ensure_ascii=False, allow_nan=False)
        write_whole("-", json_bytes(f"{text}\n"))
    else:
        answer(f"{as_text(facts)}\n")


def facts_of(log: LaserLog) -> dict[str, Any]:
    """What `info --json` prints; lengths in m, times in s, angles in degrees, keys always the same."""
    import numpy as np

    beams = log.ranges.shape[1]
    steps = np.diff(log.times)
    duration = float(log.times[-1] - log.times[0])
    first, step = math.degrees(log.angle_min[0]), math.degrees(log.angle_increment[0])
    path = None if log.odometry is None else np.diff(log.odometry[:, :2], axis=0)
    return {
        "file": log.source.name,
        "sha256": log.source.sha256,
        "bytes": log.source.bytes,
        "format": log.format,
        "laser": log.laser,
        "scans": len(log),
        "first_scan": int(log.numbers[0]),
        "last_scan": int(log.numbers[-1]),
        "beams": beams,
        "angle_min": round(first, 6),
        "angle_max": round(first + (beams - 1) * step, 6),
        "angle_increment": round(step, 6),
        "start": log.stamps[0],
        "duration": round(duration, 6),
        "rate": round(len(steps) / duration, 3) if duration > 0 else None,
        "longest_gap": round(float(steps.max()), 6) if len(steps) else None,
        "odometry": None if path is None else {"path": round(float(np.hypot(*path.T).sum()), 3)},
        "no_return": log.no_return,
        "beams_without_return": _share(np.isinf(log.ranges)),
        "beams_unusable": _share(np.isnan(log.ranges)),
        "mounting": [*(round(float(part), 6) for part in log.mount[:2]), _degrees(log.mount[2])],
        "range_limits": [round(limit, 6) for limit in log.range_limits],
        "used": log.report.used,
        "records": log.report.records,
        "skipped": [
            {"reason": reason, "records": count, f"first_{log.report.skipped_place}": first}
            for reason, (count, first) in log.report.skipped.items()
        ],
        "backward_stamps": log.report.backward_stamps,
        "truth": 0 if log.truth is None else len(log.truth),
        "warnings": list(log.report.warnings),
    }


def as_text(facts: dict[str, Any]) -> str:
    """The facts as aligned lines, one a fact; those that may repeat as several lines."""
    odometry, no_return, gap = facts["odometry"], facts["no_return"], facts["longest_gap"]
    x, y, degrees = facts["mounting"]
    low, high = facts["range_limits"]
    used = facts["used"]
    path = "" if odometry is None else f"a path of {odometry['path']:.1f} m"
    rate = "" if facts["rate"] is None else f", {facts['rate']:.3g} a second, longest gap {gap:.3g} s"
    rows: list[Row] = [
        ("log", [f"{facts['file']}, {facts['bytes']} bytes"]),
        ("sha256", [facts["sha256"]]),
        ("format", [facts["format"]]),
        ("checksums", [used["checksums"]] if "checksums" in used else []),
        ("laser", [f"{facts['laser']}, {used['laser']}"]),
        ("scans", [f"{facts['scans']}, numbered {facts['first_scan']} to {facts['last_scan']}{rate}"]),
        ("duration", [f"{facts['duration']:.1f} s from {facts['start']}"]),
        ("beams", [f"{facts['beams']}"]),
        ("field of view", [f"{facts['angle_min']:g}° to {facts['angle_max']:g}°, "
                           f"{facts['angle_increment']:g}° a beam"]),
        ("range limits", [f"{low:g} m to {high:g} m"]),
        ("no return", ["no such value" if no_return is None else f"{no_return:g} m and above"]),
        ("beams lost", [f"{facts['beams_without_return']:.1%} without return, "
                        f"{facts['beams_unusable']:.1%} unusable"]),
        ("mounting", [f"{x:g} m ahead, {y:g} m to the left, turned by {degrees:g}°",
                      used["mounting"]]),
        ("odometry", [path, used["odometry"]] if path else [used["odometry"]]),
        ("truth", [counted(facts["truth"], "pose") if facts["truth"] else "none"]),
        ("records", [f"{count} {tag}" for tag, count in facts["records"].items()]),
        ("out of order", [counted(facts["backward_stamps"], "time stamp") if facts["backward_stamps"]
                          else "none"]),
        ("skipped", [_skipped(entry) for entry in facts["skipped"]] or ["none"]),
        ("warnings", facts["warnings"] or ["none"]),
    ]  # fmt: skip
    return table(rows)


def _skipped(entry: dict[str, Any]) -> str:
    ((place, first),) = (
        (key.removeprefix("first_"), entry[key]) for key in entry if key.startswith("first_")
    )
    return f"{counted(entry['records'], 'record')}: {entry['reason']}, first in {place} {first}"


def _share(beams: Any) -> float:
    return round(float(beams.mean()), 6)


def _degrees(angle: float) -> float:
    return round(math.degrees(angle), 6) + 0.0
