"""The parameters of a log in a manifest: options of `slam` by their long names."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.reading_options import ReadingOptions, sector_text, sectors_from

RELATION_CHOICES = ("pairwise", "nscan", "both")
MAPPING_PARAMETERS = {"max-scans": int, "relations": str, "no-loops": bool, "verify-bound": float}
"""Options of mapping, each with the type of its value in TOML."""
DEGREE_OPTIONS = ("angle-min", "angle-increment")
"""Options that are in degrees in a manifest, and in rad here."""


@dataclass(frozen=True)
class LogParameters:
    """How a log is read and mapped; what a manifest does not give has the defaults of `slam`."""

    reading: ReadingOptions = field(default_factory=ReadingOptions)
    mapping: dict[str, Any] = field(default_factory=dict)
    """Those of MAPPING_PARAMETERS that the manifest gives."""

    def as_table(self) -> dict[str, Any]:
        """The parameters as a table of a manifest, without those that have their defaults."""
        defaults, table = dataclasses.asdict(ReadingOptions()), dict[str, Any]()
        for name, value in dataclasses.asdict(self.reading).items():
            key = name.replace("_", "-")
            if value == defaults[name]:
                continue
            if key == "odometry":
                table["no-odometry"] = True
            elif key == "mask":
                table[key] = ",".join(sector_text(sector) for sector in value)
            elif key == "mount":
                table[key] = [value[0], value[1], round(math.degrees(value[2]), 9)]
            else:
                table[key] = round(math.degrees(value), 9) if key in DEGREE_OPTIONS else value
        return {**table, **self.mapping}


def parameters_from(place: str, table: dict[str, Any]) -> LogParameters:
    """The parameters from a table of a manifest; messages begin with `place`. Raises InputDataError."""
    known = _reading_options() | MAPPING_PARAMETERS
    reading: dict[str, Any] = {}
    mapping: dict[str, Any] = {}
    for key, value in table.items():
        if key not in known:
            problem = f"parameters has an unknown key {key!r}"
            raise InputDataError(place, problem, f"known: {', '.join(sorted(known))}")
        wanted = known[key]
        if wanted is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not _is_a(value, wanted):
            raise _parameter_error(place, key, value, TYPE_WORDS[wanted])
        if key in MAPPING_PARAMETERS:
            mapping[key] = value
        elif key == "mount":
            reading["mount"] = _mount_pose(place, value)
        elif key == "no-odometry":
            reading["odometry"] = not value
        elif key == "mask":
            reading["mask"] = _mask_sectors(place, value)
        else:
            reading[key.replace("-", "_")] = math.radians(value) if key in DEGREE_OPTIONS else value
    if mapping.get("max-scans", 3) < 3:
        raise _parameter_error(place, "max-scans", mapping["max-scans"], "3 or more")
    if mapping.get("verify-bound", 1.0) <= 0:
        raise _parameter_error(place, "verify-bound", mapping["verify-bound"], "a number above 0")
    if mapping.get("relations", "both") not in RELATION_CHOICES:
        raise _parameter_error(
            place, "relations", mapping["relations"], f"one of {', '.join(RELATION_CHOICES)}"
        )
    if reading.get("every", 1) < 1:
        raise _parameter_error(place, "every", reading["every"], "1 or more")
    try:
        return LogParameters(ReadingOptions(**reading), mapping)
    except WrongUsageError as error:
        raise InputDataError(place, f"parameters: {error}", "correct them") from error


TYPE_WORDS = {
    float: "a number",
    int: "a whole number",
    str: "a text",
    bool: "true or false",
    list: "[x, y, degrees]",
}


def _reading_options() -> dict[str, type]:
    """Long name of each reading option → the type of its value in TOML."""
    types: dict[str, type] = {"str": str, "float": float, "int": int, "bool": bool, "tuple": list}
    options = {}
    for option in dataclasses.fields(ReadingOptions):
        # Annotations are text: "float | None", "tuple[float, float, float] | None".
        kind = str(option.type).partition(" ")[0].partition("[")[0]
        name = "no-odometry" if option.name == "odometry" else option.name.replace("_", "-")
        options[name] = types[kind]
    return {**options, "mask": str}


def _is_a(value: Any, wanted: type) -> bool:
    """Whether a value is of exactly this type, so that true and false are not numbers."""
    return type(value) is wanted


def _mount_pose(place: str, value: list[Any]) -> tuple[float, float, float]:
    if len(value) != 3 or not all(type(part) in (int, float) for part in value):
        raise _parameter_error(place, "mount", value, TYPE_WORDS[list])
    x, y, degrees = value
    return float(x), float(y), math.radians(degrees)


def _mask_sectors(place: str, value: str) -> tuple[tuple[float, ...], ...]:
    try:
        return sectors_from(value)
    except ValueError as error:
        raise _parameter_error(place, "mask", value, "FROM:TO,..., as in 130:150,-150:-130") from error


def _parameter_error(place: str, key: str, value: Any, wanted: str) -> InputDataError:
    return InputDataError(place, f"parameters: {key} is {value!r}", f"give {wanted}")
