"""What `info` reports beyond the laser in use: the other lasers, and choices that need an option."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from nscan_cli.cli.log_reader import ReadLog, log_reader
from nscan_cli.errors import InputDataError, NscanError
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.logs.device_choice import Device, OpenChoiceError
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.logs.recordings.mounting import MountingError


ZERO_MOUNT = (0.0, 0.0, 0.0)
LASER_INDEPENDENT = ("file", "sha256", "bytes", "files", "format", "odometry", "used", "records", "truth",
                 "warnings", "lasers", "odometries", "corrected")  # fmt: skip
"""Facts that are known if no laser is chosen."""


class Survey(NamedTuple):
    """A log and all lasers and odometries in it."""

    log: LaserLog
    """The log of the laser in use, or of the first one if none is chosen."""
    lasers: list[dict[str, Any]]
    """The facts of each laser for `info --json`."""
    choices: dict[str, OpenChoiceError]
    """Choices that need an option, by "laser" and "odometry"."""
    unmounted: MountingError | None
    """Why the other commands refuse the mounting of the laser, if they do."""

    @property
    def refused(self) -> InputDataError | None:
        """Why the other commands refuse the log: the mounting, or no usable reading. None if they do not."""
        return self.unmounted or (None if "laser" in self.choices else self.log.report.unusable)

    def facts(self, reading: ReadingOptions) -> dict[str, Any]:
        """The facts that replace those of the log of one laser."""
        report = self.log.report
        used = dict(report.used)
        if report.corrected and reading.odometry and not reading.allow_corrected:
            used["odometry"] += "; other commands need --allow-corrected or --no-odometry"
        if self.unmounted is not None:
            used["mounting"] = f"refused: {self.unmounted.problem}"
        for what, choice in self.choices.items():
            used[what] = f"several; {choice.remedy}"
        odometry = self.choices.get("odometry")
        found = report.odometries if odometry is None else odometry.devices
        return {
            "used": used,
            "lasers": self.lasers,
            "odometries": [_device_facts(one) for one in found],
        }

    def without_unchosen(self, facts: dict[str, Any]) -> dict[str, Any]:
        """The facts, with null for what depends on a choice of laser or on a mounting that is not there."""
        unknown = {"mounting"} if self.unmounted is not None else set()
        if "laser" in self.choices:
            unknown = facts.keys() - set(LASER_INDEPENDENT)
        return {key: None if key in unknown else value for key, value in facts.items()}


def survey_of(paths: Sequence[str], reading: ReadingOptions) -> Survey:
    """Read the log at `paths`, also if choices are open or the other commands refuse it.

    Raises what read_log raises, except for open choices, corrected poses, mountings that are refused, and
    logs without usable readings.
    """
    from nscan_cli.logs.device_choice import OpenChoiceError
    from nscan_cli.logs.recordings.mounting import MountingError

    read = log_reader(paths, even_unusable=True)
    options = dataclasses.replace(reading, allow_corrected=True)
    choices: dict[str, OpenChoiceError] = {}
    others: list[dict[str, Any]] = []
    first: dict[str, Any]
    unmounted: MountingError | None = None
    log = None
    while log is None:
        try:
            log = read(options)
        except OpenChoiceError as choice:
            choices[choice.what] = choice
            if choice.what == "laser":
                first, *others = [{choice.chooses: one.name, "mount": ZERO_MOUNT} for one in choice.devices]
            else:
                first = {"odometry": False}
            options = dataclasses.replace(options, **first)
        except MountingError as error:
            unmounted = error
            options = dataclasses.replace(options, mount=ZERO_MOUNT)
        except InputDataError:
            # If none is chosen, any laser that can be read gives the facts of the whole log.
            if not others:
                raise
            options = dataclasses.replace(options, **others.pop(0))
    alone = dataclasses.replace(reading, odometry=False)
    chosen = None if "laser" in choices else log
    lasers = [
        _laser_facts(laser, log.report.laser_option, chosen, read, alone) for laser in log.report.lasers
    ]
    if unmounted is not None:
        next(one for one in lasers if one["name"] == log.laser)["problem"] = unmounted.problem
    return Survey(log, lasers, choices, unmounted)


def rate_of(log: LaserLog) -> float | None:
    """Scans per second; None if the log has no duration."""
    duration = float(log.times[-1] - log.times[0])
    return round((len(log) - 1) / duration, 3) if duration > 0 else None


def laser_line(laser: dict[str, Any]) -> str:
    """A laser in the table of `info`."""
    kind = "" if laser["type"] == laser["name"] else f" ({laser['type']})"
    said = counted(laser["records"], "record")
    if laser["scans"] is not None:
        rate = "" if laser["rate"] is None else f", {laser['rate']:.3g} a second"
        said = f"{counted(laser['scans'], 'scan')} of {counted(laser['beams'], 'beam')}{rate}"
    return f"{laser['name']}{kind}: {said}{'' if laser['problem'] is None else '; ' + laser['problem']}"


def _laser_facts(
    laser: Device, option: str, chosen: LaserLog | None, read: ReadLog, alone: ReadingOptions
) -> dict[str, Any]:
    """The facts of a laser for `info --json`; the log is read again unless it is the `chosen` one."""
    from nscan_cli.logs.recordings.mounting import MountingError

    facts = {**_device_facts(laser), "scans": None, "beams": None, "rate": None, "problem": None}
    own: dict[str, Any] = {option.removeprefix("--"): laser.name}
    alone = dataclasses.replace(alone, **own)
    log = chosen if chosen is not None and chosen.laser == laser.name else None
    try:
        while log is None:
            try:
                log = read(alone)
            except MountingError as error:
                facts["problem"] = error.problem
                alone = dataclasses.replace(alone, mount=ZERO_MOUNT)
    except NscanError as error:
        return facts | {"problem": str(error)}
    return facts | {"scans": len(log), "beams": int(log.beam_counts().max()), "rate": rate_of(log)}


def _device_facts(device: Device) -> dict[str, Any]:
    return {"name": device.name, "type": device.type, "records": device.records}
