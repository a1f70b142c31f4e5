"""What a log leaves open to its user: which of several lasers, which of several odometries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.counting import counted


class Device(NamedTuple):
    """A laser or an odometry of a log."""

    name: str
    """What the option that chooses it takes."""
    type: str
    """Of its records or messages, such as sensor_msgs/msg/LaserScan."""
    records: int
    """How many there are: records of a text log, messages of a recording."""


class OpenChoiceError(WrongUsageError):
    """A log has several lasers or odometries, and the user has chosen none."""

    def __init__(
        self,
        file: str,
        what: Literal["laser", "odometry"],
        devices: Sequence[Device],
        option: str,
        thing: str,
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
    """The devices with how many things ("message", "record") each has, as messages list them."""
    return ", ".join(f"{one.name} ({counted(one.records, thing)})" for one in devices)
