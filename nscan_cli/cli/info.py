"""`nscan-cli info`: what a log contains, and what the other commands use of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from nscan_cli.cli.compilation import Compiling
from nscan_cli.cli.laser_survey import laser_line, rate_of, survey_of
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.standard_streams import print_json, print_result
from nscan_cli.cli.subcommand import json_option, log_argument, subcommand
from nscan_cli.cli.summary import Row, summary_table
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.logs.laser_log import LaserLog


@subcommand(
    "info",
    ("nscan-cli info robot.log.gz", "what a log contains"),
    ("nscan-cli info --json robot.mcap | jq .scans", "one value, for a script"),
)
@log_argument()
@json_option
@reading_options
@common_options
def command(log: tuple[str, ...], as_json: bool, reading: ReadingOptions, **_common: Any) -> None:
    """Show what LOG contains, and what the other commands use of it.

    It prints the scans, the laser and its mounting, odometry, the value for no return, and skipped records
    with reasons. The reading options have the same effect as in the other commands. If the other commands
    need an option to choose a laser or odometry, all choices are listed. If they refuse the log, info prints
    what it has found, then fails with the same error.
    """
    survey = survey_of(log, reading)
    facts = survey.without_unchosen(facts_of(survey.log, reading) | survey.facts(reading))
    if survey.refused is None and not survey.choices:
        Compiling("up to half a minute", bool(_common["quiet"]))
        facts["warnings"] += _contradictions(survey.log, reading)
    if as_json:
        print_json(facts)
    else:
        print_result(f"{facts_table(facts)}\n")
    if survey.refused is not None:
        raise survey.refused


def _contradictions(log: LaserLog, reading: ReadingOptions) -> list[str]:
    from nscan_cli.calibration.file_check import checked_file
    from nscan_cli.calibration.options import FileCheckOptions

    return checked_file(log, reading, FileCheckOptions()).messages


def facts_of(log: LaserLog, reading: ReadingOptions) -> dict[str, Any]:
    """The object that `info --json` prints, in m, s and degrees. Its keys are always the same."""
    import numpy as np

    from nscan_cli.logs.field_of_view import beams_lost, field_of_view

    fewest, beams = (int(count) for count in (log.beam_counts().min(), log.beam_counts().max()))
    steps = np.diff(log.times)
    duration = float(log.times[-1] - log.times[0])
    first, last, step = (math.degrees(angle) for angle in field_of_view(log))
    increments = [_rounded_degrees(find(log.angle_increment)) for find in (np.min, np.max)]
    without_return, unusable = beams_lost(log)
    path = None if log.odometry is None else np.diff(log.odometry[:, :2], axis=0)
    return {
        "file": log.source.name,
        "sha256": log.source.sha256,
        "bytes": log.source.bytes,
        "files": [file.record for file in log.source.files],
        "format": log.format,
        "laser": log.laser,
        "scans": len(log),
        "first_scan": int(log.numbers[0]),
        "last_scan": int(log.numbers[-1]),
        "beams": beams,
        "fewest_beams": fewest,
        "angle_min": round(first, 6),
        "angle_max": round(last, 6),
        "angle_increment": round(step, 6),
        "angle_increments": increments,
        "turn": _turn(log, reading.stamp),
        "start": log.stamps[0],
        "duration": round(duration, 6),
        "rate": rate_of(log),
        "longest_gap": round(float(steps.max()), 6) if len(steps) else None,
        "odometry": None if path is None else {"path": round(float(np.nansum(np.hypot(*path.T))), 3)},
        "no_return": log.no_return,
        "beams_without_return": round(without_return, 6),
        "beams_unusable": round(unusable, 6),
        "beams_lost": log.report.lost,
        "mounting": [*(round(float(part), 6) for part in log.mount[:2]), _rounded_degrees(log.mount[2])],
        "range_limits": [round(limit, 6) for limit in log.range_limits],
        "used": log.report.used,
        "records": log.report.records,
        "skipped": [
            {"reason": reason, "records": count, f"first_{log.report.skipped_place}": first}
            for reason, (count, first) in log.report.skipped.items()
        ],
        "backward_stamps": log.report.backward_stamps,
        "truth": 0 if log.truth is None else len(log.truth),
        "warnings": [*log.report.warnings, *log.report.contradictions],
        "lasers": [],
        "odometries": [],
        "corrected": log.report.corrected or None,
    }


def facts_table(facts: dict[str, Any]) -> str:
    """The facts as a table; a fact with several values has several lines."""
    of_laser = [] if facts["laser"] is None else _of_laser(facts)
    return summary_table([*_of_file(facts), *of_laser, *_of_whole(facts)])


def _of_file(facts: dict[str, Any]) -> list[Row]:
    used, files = facts["used"], facts["files"]
    chosen = [used["laser"] if facts["laser"] is None else f"{facts['laser']}, {used['laser']}"]
    lasers = [laser_line(laser) for laser in facts["lasers"]]
    return [
        ("log", [f"{facts['file']}, {facts['bytes']} bytes"]),
        ("files", [f"{file['name']}, {file['bytes']} bytes" for file in files] if len(files) > 1 else []),
        ("sha256", [file["sha256"] for file in files]),
        ("format", [facts["format"]]),
        ("checksums", [used["checksums"]] if "checksums" in used else []),
        ("laser", [*chosen, *(lasers if len(lasers) > 1 else [])]),
    ]


def _of_laser(facts: dict[str, Any]) -> list[Row]:
    no_return, gap, used = facts["no_return"], facts["longest_gap"], facts["used"]
    low, high = facts["range_limits"]
    finest, coarsest = facts["angle_increments"]
    rate = "" if facts["rate"] is None else f", {facts['rate']:.3g} a second, longest gap {gap:.3g} s"
    return [
        ("scans", [f"{facts['scans']}, numbered {facts['first_scan']} to {facts['last_scan']}{rate}"]),
        ("duration", [f"{facts['duration']:.1f} s from {facts['start']}"]),
        ("beams", [_interval(facts["fewest_beams"], facts["beams"]),
                   *([used["beams"]] if "beams" in used else [])]),
        ("field of view", [f"{facts['angle_min']:g}° to {facts['angle_max']:g}°, "
                           f"{_interval(finest, coarsest, '°')} a beam"]),
        ("range limits", [f"{low:g} m to {high:g} m",
                          f"lower: {used['range_min']}", f"upper: {used['range_max']}"]),
        ("turn", [_turn_line(facts["turn"]), used["turn"]] if "turn" in used else []),
        ("no return", ["no special value" if no_return is None else f"{no_return:g} m and above"]),
        ("beams lost", [f"{facts['beams_without_return']:.1%} without return, "
                        f"{facts['beams_unusable']:.1%} unusable",
                        *(f"{count:,} {why}" for why, count in facts["beams_lost"].items())]),
        ("mounting", [*([] if facts["mounting"] is None else [_mounting_line(*facts["mounting"])]),
                      used["mounting"]]),
    ]  # fmt: skip


def _of_whole(facts: dict[str, Any]) -> list[Row]:
    odometry, used, backward = facts["odometry"], facts["used"], facts["backward_stamps"]
    path = [] if odometry is None else [f"a path of {odometry['path']:.1f} m"]
    several = [
        f"{one['name']} ({one['type']}): {counted(one['records'], 'record')}" for one in facts["odometries"]
    ]
    backwards = [] if backward is None else [counted(backward, "time stamp") if backward else "none"]
    skipped = None if facts["skipped"] is None else [_skipped_line(entry) for entry in facts["skipped"]]
    return [
        ("odometry", [*path, used["odometry"], *(several if len(several) > 1 else [])]),
        ("truth", [counted(facts["truth"], "pose") if facts["truth"] else "none"]),
        ("records", [f"{count} {tag}" for tag, count in facts["records"].items()]),
        ("out of order", backwards),
        ("skipped", [] if skipped is None else skipped or ["none"]),
        ("warnings", facts["warnings"] or ["none"]),
    ]


def _turn(log: LaserLog, stamp: str) -> dict[str, Any] | None:
    """The usual time of a sweep of the laser as --sweep takes it, s; None if all beams are seen at once."""
    import numpy as np

    if log.beam_times is None:
        return None
    turns = log.beam_times.step * 2 * np.pi / np.abs(log.angle_increment)
    return {"seconds": round(float(np.median(turns)), 6), "stamp": stamp}


def _turn_line(turn: dict[str, Any] | None) -> str:
    if turn is None:
        return "all beams of a scan are seen at once"
    order = ", readings in the reverse order of time" if turn["seconds"] < 0 else ""
    return f"a turn takes {abs(turn['seconds']):.3g} s, stamp at the {turn['stamp']} beam{order}"


def _mounting_line(x: float, y: float, degrees: float) -> str:
    """The pose of a laser on the robot in words (m, degrees)."""
    ahead, left = "ahead" if x >= 0 else "behind", "left" if y >= 0 else "right"
    return f"{abs(x):g} m {ahead}, {abs(y):g} m to the {left}, turned by {degrees:g}°"


def _skipped_line(entry: dict[str, Any]) -> str:
    ((place, first),) = (
        (key.removeprefix("first_"), entry[key]) for key in entry if key.startswith("first_")
    )
    return f"{counted(entry['records'], 'record')}: {entry['reason']}, first in {place} {first}"


def _interval(least: float, most: float, unit: str = "") -> str:
    return f"{most:g}{unit}" if least == most else f"{least:g}{unit} to {most:g}{unit}"


def _rounded_degrees(angle: float) -> float:
    return round(math.degrees(angle), 6) + 0.0
