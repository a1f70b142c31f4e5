"""The choice between several lasers or several odometries of a log."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.text import counted


class Device(NamedTuple):
    """A laser or an odometry of a log."""

    name: str
    """The value of the option that chooses it."""
    type: str
    """Type of its records or messages, such as sensor_msgs/msg/LaserScan."""
    records: int
    """Number of records of a text log, or of messages of a recording."""


DeviceKind = Literal["laser", "odometry"]


class OpenChoiceError(WrongUsageError):
    """A log has several lasers or odometries, and the user has not chosen one."""

    def __init__(
        self, file: str, what: DeviceKind, devices: Sequence[Device], option: str, thing: str
    ) -> None:
        several = {"laser": "lasers", "odometry": "odometries"}[what]
        none = ", or none by --no-odometry" if what == "odometry" else ""
        self.what, self.devices, self.option = what, tuple(devices), option
        self.remedy = f"choose one by {option}{none}"
        super().__init__(f"{file}: has several {several}, {device_list(devices, thing)}; {self.remedy}")

    @property
    def chooses(self) -> str:
        """The field of ReadingOptions that the option sets."""
        return self.option.removeprefix("--").replace("-", "_")


def device_list(devices: Sequence[Device], thing: str) -> str:
    """The devices and their numbers of things ("message", "record"), as text."""
    return ", ".join(f"{one.name} ({counted(one.records, thing)})" for one in devices)


def choose_device(
    what: DeviceKind, requested: str | None, devices: Sequence[Device], file: str
) -> tuple[str | None, str]:
    """The name of the device of a text log to use, and the reason; None if there is no device.

    Raises WrongUsageError if the requested one is not there, and OpenChoiceError if none is requested and
    there are several.
    """
    option = "--laser" if what == "laser" else "--odom-topic"
    if requested is not None:
        if requested not in [device.name for device in devices]:
            available = device_list(devices, "record") or "left out"
            raise WrongUsageError(f"{file}: has no {requested}; {option} can be {available}")
        return requested, f"chosen by {option}"
    if len(devices) > 1:
        raise OpenChoiceError(file, what, devices, option, "record")
    return (devices[0].name, f"the only {what}") if devices else (None, "")
