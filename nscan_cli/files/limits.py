"""Limits on inputs, so that damaged files do not exhaust memory.

An environment variable sets each, for instance NSCAN_CLI_MAX_BEAMS=50000. docs/limits.md gives the memory
that each allows.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

from nscan_cli.errors import WrongUsageError

LIMIT_PREFIX = "NSCAN_CLI_MAX_"
"""Prefix of the names of the environment variables."""
MB = 1 << 20
"""Bytes of a megabyte, as limits count it."""


class LimitExceededError(Exception):
    """An input exceeds a limit. The caller adds the name of the input."""

    def __init__(self, limit: Limit, problem: str) -> None:
        super().__init__(f"{problem}, more than the limit of {limit.text()}")
        self.remedy = f"set {limit.variable} higher if it is right"


@dataclass(frozen=True)
class Limit:
    """An upper bound on something in an input."""

    name: str
    """Name of the environment variable behind LIMIT_PREFIX."""
    default: float
    """The limit where the variable is not set."""
    unit: str
    """The unit, written after the number in messages."""

    @property
    def variable(self) -> str:
        """The environment variable that sets it."""
        return LIMIT_PREFIX + self.name

    @property
    def value(self) -> float:
        """The limit in force. Raises WrongUsageError if the variable is not a positive number."""
        text = os.environ.get(self.variable)
        if text is None:
            return self.default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0 < value < math.inf:
            raise WrongUsageError(
                f"{self.variable}={text}: is not a number above 0; leave it unset for {self.default:g}"
            )
        return value

    @property
    def bytes(self) -> int:
        """The limit in bytes, if its unit is MB."""
        return int(self.value * MB)

    def text(self) -> str:
        """The limit in messages, with its unit."""
        value = float(self.value)
        number = f"{value:,.0f}" if value.is_integer() and value < 1e9 else f"{value:g}"
        return f"{number} {self.unit}".strip()

    def check(self, value: float, problem: str) -> None:
        """Raises LimitExceededError if the value is greater; `problem` describes it."""
        if value > self.value:
            raise LimitExceededError(self, problem)


INPUT = Limit("INPUT_MB", 1024, "MB")
"""Size of a stored log, and of the data that is kept of it when unpacked."""
UNPACKED = Limit("UNPACKED_MB", 65_536, "MB")
"""Total size of the unpacked chunks of a recording, of which only the messages in use are kept."""
GRAPH = Limit("GRAPH_MB", 256, "MB")
"""Size of a graph, a trajectory or a file of relations."""
CONFIG = Limit("CONFIG_MB", 1, "MB")
"""Size of a TOML file."""
BEAMS = Limit("BEAMS", 16384, "beams")
"""Beams of a scan. A record with more is skipped."""
READINGS = Limit("READINGS", 250_000_000, "readings")
"""Readings of a log: scans times the beams of the longest scan, 4 bytes each."""
MAP_CELLS = Limit("MAP_CELLS", 200_000_000, "cells")
"""Cells of a map, 8 bytes for each that is seen. The default is 700 m × 700 m at 0.05 m."""
RECORD_KINDS = Limit("KINDS", 1000, "kinds")
"""Kinds of records (tags, devices) that are distinguished in a text log."""
DISTANCE = Limit("DISTANCE", 1e9, "m")
"""Largest coordinate of a pose, or other number in its record."""
TIME = Limit("TIME", 1e11, "s")
"""Largest absolute time stamp."""
INFORMATION = Limit("INFORMATION", 1e30, "")
"""Largest absolute entry of an information, Hessian or covariance matrix."""
