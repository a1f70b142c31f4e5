"""How much of an input is taken before it is refused. Each limit has a name, and can be raised or lowered.

NSCAN_CLI_MAX_BEAMS=50000 in the environment sets the limit BEAMS, and likewise the others. docs/limits.md
says what each costs in memory.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

from nscan_cli.errors import WrongUsageError

LIMIT_PREFIX = "NSCAN_CLI_MAX_"
MB = 1 << 20


class LimitExceededError(Exception):
    """An input is beyond a limit; who knows the input's name makes a message of it."""

    def __init__(self, limit: Limit, problem: str) -> None:
        super().__init__(f"{problem}, more than the {limit.shown()} that are taken")
        self.remedy = f"set {limit.variable} higher if it is right"


@dataclass(frozen=True)
class Limit:
    """A number that nothing in an input may exceed."""

    name: str
    default: float
    unit: str
    """What follows the number in a message."""

    @property
    def variable(self) -> str:
        """The environment variable that sets it."""
        return LIMIT_PREFIX + self.name

    @property
    def value(self) -> float:
        """The limit in force. Raises WrongUsageError when the variable holds no positive number."""
        text = os.environ.get(self.variable)
        if text is None:
            return self.default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0 < value < math.inf:
            raise WrongUsageError(
                f"{self.variable}={text}: is no number above 0; leave it unset for {self.default:g}"
            )
        return value

    @property
    def bytes(self) -> int:
        """A limit that is in MB, as bytes."""
        return int(self.value * MB)

    def shown(self) -> str:
        """As messages say it."""
        value = float(self.value)
        number = f"{value:,.0f}" if value.is_integer() and value < 1e9 else f"{value:g}"
        return f"{number} {self.unit}".strip()

    def check(self, value: float, problem: str) -> None:
        """Raises ExceededError when the value, which `problem` tells of, is greater."""
        if value > self.value:
            raise LimitExceededError(self, problem)


INPUT = Limit("INPUT_MB", 1024, "MB")
"""Of a log: as it is stored, and again of all that it unpacks to and that is kept."""
UNPACKED = Limit("UNPACKED_MB", 65_536, "MB")
"""Of the chunks of a recording, one after the other: of them only the wanted messages are kept."""
GRAPH = Limit("GRAPH_MB", 256, "MB")
"""Of a graph, a trajectory or a file of relations."""
CONFIG = Limit("CONFIG_MB", 1, "MB")
"""Of a TOML file."""
BEAMS = Limit("BEAMS", 16384, "beams")
"""Of a scan; a record with more is skipped."""
READINGS = Limit("READINGS", 250_000_000, "readings")
"""Of a log: its scans times the beams of the widest one; 4 bytes each."""
MAP_CELLS = Limit("MAP_CELLS", 200_000_000, "cells")
"""Of a map; 700 m × 700 m at 0.05 m. 8 bytes each for what is seen."""
RECORD_KINDS = Limit("KINDS", 1000, "kinds")
"""Of records (tags, devices) in a text that are told from each other."""
DISTANCE = Limit("DISTANCE", 1e9, "m")
"""No coordinate of a pose, and no other number of its record, is beyond."""
TIME = Limit("TIME", 1e11, "s")
"""No time stamp is beyond, before 0 or after."""
INFORMATION = Limit("INFORMATION", 1e30, "")
"""No entry of an information, Hessian or covariance matrix is beyond."""
ALL = (INPUT, UNPACKED, GRAPH, CONFIG, BEAMS, READINGS, MAP_CELLS, RECORD_KINDS, DISTANCE, TIME, INFORMATION)
