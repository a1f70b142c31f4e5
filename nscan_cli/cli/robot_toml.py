"""Reading options that belong to a robot and not to one of its logs, as a user writes them."""

from __future__ import annotations

import json
from typing import Any

from nscan_cli.logs.reading_options import ReadingOptions

ROBOT_OPTIONS = (
    "laser", "topic", "odom-topic", "flip", "mount", "sweep", "stamp", "odometry-scale", "clock-offset",
    "range-scale", "range-offset", "mask",
)  # fmt: skip
"""Their long names."""


def robot_table(reading: ReadingOptions) -> dict[str, Any]:
    """Those that differ from their defaults, by their long names; angles in degrees."""
    from nscan_cli.nightly.manifest_parameters import LogParameters

    table = LogParameters(reading).as_table()
    return {key: table[key] for key in ROBOT_OPTIONS if key in table}


def robot_toml(reading: ReadingOptions) -> str:
    """The same as the top of a TOML file, which counts for every command."""
    # JSON writes such values as TOML does.
    lines = [f"{key} = {json.dumps(value)}" for key, value in robot_table(reading).items()]
    return "\n".join(["# Written by nscan-cli calibrate, for --config of all commands.", *lines]) + "\n"


def changed_flags(before: ReadingOptions, after: ReadingOptions) -> str:
    """The options that lead from one to the other, as they are typed; empty if there are none."""
    known, table = robot_table(before), robot_table(after)
    flags = [_flag(key, value) for key, value in table.items() if known.get(key) != value]
    return " ".join([*flags, *(f"(without --{key})" for key in known if key not in table)])


def _flag(key: str, value: Any) -> str:
    if isinstance(value, bool):
        return f"--{key}"
    parts = value if isinstance(value, list) else [value]
    return f"--{key} {','.join(part if isinstance(part, str) else f'{part:g}' for part in parts)}"
