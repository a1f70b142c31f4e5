"""`nscan-cli calibrate`: what the scans of a drive say about the robot and its file."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from nscan_cli.cli.compilation import Compiling
from nscan_cli.cli.log_reader import log_reader
from nscan_cli.cli.robot_toml import changed_flags, robot_table, robot_toml
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.standard_streams import print_json, print_result
from nscan_cli.cli.subcommand import PATH, json_option, log_argument, option, subcommand
from nscan_cli.cli.summary import Row, summary_table
from nscan_cli.files.outputs import check_writable, write_atomically
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from nscan_cli.calibration.estimate import Estimate
    from nscan_cli.calibration.robot_calibration import Calibration
    from nscan_cli.logs.laser_log import LaserLog

DEGREES = math.degrees(1.0)
"""In a radian."""
ANGLE_VALUES = ("mount_angle", "veer")
"""Values in rad, or rad/m, that are printed in degrees."""
VALUE_UNITS = {
    "mount_x": "m",
    "mount_y": "m",
    "mount_angle": "degrees",
    "veer": "degrees/m",
    "wheel_difference": "1/m",
    "clock_offset": "s",
    "sweep_time": "s",
}
"""The other values have none."""


@subcommand(
    "calibrate",
    ("nscan-cli calibrate drive.mcap", "laser, odometry and clocks from the scans"),
    ("nscan-cli calibrate drive.mcap -o robot.toml", "as options for --config of all commands"),
    ("nscan-cli calibrate drive.mcap --json", "for a program"),
)
@log_argument()
@option("-o", "--output", type=PATH, metavar="ROBOT.toml",
        help="Also write the options for --config of all commands.")  # fmt: skip
@json_option
@reading_options
@common_options
def command(
    log: tuple[str, ...],
    output: str | None,
    as_json: bool,
    reading: ReadingOptions,
    quiet: bool,
    **_verbosity: int,
) -> None:
    """Find from an ordinary drive how the laser is mounted and turns, and the errors of odometry and clocks.

    Steps from scan to scan, matched without odometry, are compared with the same steps by odometry. Each
    value stands with its standard deviation and the value in the file. The drive needs turns, and more in
    view than bare walls. Values that it does not determine are listed. If a recording has several lasers,
    each is calibrated, unless --topic chooses one.
    """
    if output is not None:
        check_writable(output)
    from nscan_cli.kernels.decorators import load_runtime

    load_runtime()
    Compiling("up to half a minute", quiet)
    found = [
        _Calibrated.of(scans, own_reading) for own_reading, scans in _lasers(log, reading, output is None)
    ]
    if as_json:
        lasers = [one.facts() for one in found]
        print_json(lasers[0] if len(lasers) == 1 else {"lasers": lasers})
    else:
        tables = [summary_table(one.rows(with_name=len(found) > 1)) for one in found]
        print_result("\n\n".join(tables) + "\n")
    if output is not None:
        write_atomically(output, robot_toml(found[0].calibrated).encode())


def _lasers(
    paths: Sequence[str], reading: ReadingOptions, is_each: bool
) -> Iterator[tuple[ReadingOptions, LaserLog]]:
    """The log of each laser, with the options that read it. Raises OpenChoiceError unless `is_each`."""
    from nscan_cli.logs.device_choice import OpenChoiceError

    read = log_reader(paths)
    try:
        yield reading, read(reading)
    except OpenChoiceError as choice:
        if choice.what != "laser" or not is_each:
            raise
        for one in choice.devices:
            chosen: dict[str, Any] = {choice.chooses: one.name}
            own = dataclasses.replace(reading, **chosen)
            yield own, read(own)


@dataclasses.dataclass(frozen=True)
class _Calibrated:
    """A laser and what its scans say."""

    scans: LaserLog
    reading: ReadingOptions
    """The options that the log was read with."""
    calibration: Calibration
    calibrated: ReadingOptions
    """The options that it is to be read with."""

    @classmethod
    def of(cls, scans: LaserLog, reading: ReadingOptions) -> _Calibrated:
        from nscan_cli.calibration.calibrated_reading import as_put_right, calibrated_reading
        from nscan_cli.calibration.options import CalibrationOptions
        from nscan_cli.calibration.robot_calibration import calibrate

        options = CalibrationOptions()
        calibration = calibrate(scans, reading, options)
        calibrated = calibrated_reading(calibration, reading, options)
        return cls(scans, reading, calibration, as_put_right(scans, calibrated))

    def rows(self, with_name: bool) -> list[Row]:
        """The table for people."""
        evidence, values = self.calibration.evidence, self.calibration.values
        measured = (
            f"{evidence.measured} of {counted(evidence.sampled, 'step')} measured, "
            f"{evidence.turns} with a turn"
        )
        order = "in the wrong order: mirrored" if self.calibration.mirrored else "in the order of the file"
        flags = changed_flags(self.reading, self.calibrated)
        # The file says nothing of it but 0.
        difference = dataclasses.replace(_times(values["wheel_difference"], 100.0), recorded=None)
        return [
            ("laser", [self.scans.laser] if with_name else []),
            ("steps", [f"{measured}; {evidence.distance:.1f} m and {evidence.turned:.1f} rad"]),
            ("readings", [order]),
            ("sweep", _sweep_lines(self.calibration)),
            ("mounting", [_line("x", values["mount_x"], "m"), _line("y", values["mount_y"], "m"),
                          _line("turned by", _times(values["mount_angle"], DEGREES), "°")]),
            ("odometry", [_line("scale", values["odometry_scale"]),
                          _line("turns by odometry / turns by scans", values["turn_ratio"]),
                          _line("heading drift", _times(values["veer"], DEGREES), "°/m")]),
            ("wheels", [_line("right larger than left by", difference, "% per metre of track width"),
                        _line("track width / that of odometry", values["track_width"])]),
            ("noise", [_line("per metre driven", values["noise_distance"], "m/m"),
                       _line("per radian turned", values["noise_turn"], "rad/rad")]),
            ("clock", [_line("to add to odometry's stamps", values["clock_offset"], "s")]),
            ("unknown", _unknown(self.calibration) or ["nothing"]),
            ("options", [flags or "none: the file agrees with the scans"]),
            ("warnings", self.scans.report.notices()),
        ]  # fmt: skip

    def facts(self) -> dict[str, Any]:
        """The object that `calibrate --json` prints of one laser, in m, s and degrees.

        Its keys are always the same.
        """
        evidence, found = self.calibration.evidence, self.calibration
        return {
            "steps": {
                "sampled": evidence.sampled,
                "measured": evidence.measured,
                "with_turn": evidence.turns,
                "distance": _rounded(evidence.distance),
                "turned": _rounded(math.degrees(evidence.turned)),
            },
            "mirrored": found.mirrored,
            "sweep": {"pairs": evidence.pairs, "used": _rounded(found.sweep), "stamp": found.stamp},
            "values": {name: _value_facts(name, estimate) for name, estimate in found.values.items()},
            "open": found.open,
            "options": robot_table(self.calibrated),
            "warnings": self.scans.report.notices(),
            "laser": self.scans.laser,
            "file": self.scans.source.name,
            "sha256": self.scans.source.sha256,
        }


def _sweep_lines(calibration: Calibration) -> list[str]:
    """How long the laser turns, by how many pairs of scans, and at which beam its scans are stamped."""
    turn, pairs = calibration.values["sweep_time"], calibration.evidence.pairs
    lines = [f"{_line('a turn takes', turn, 's')}, {counted(pairs, 'pair')} of scans"]
    if calibration.sweep and calibration.stamp:
        lines.append(f"stamp at the {calibration.stamp} beam")
    elif calibration.sweep:
        lines.append("stamp at a beam that cannot be told from the clock of odometry")
    return lines


def _unknown(calibration: Calibration) -> list[str]:
    by_reason: dict[str, list[str]] = {}
    for name in calibration.open:
        by_reason.setdefault(calibration.values[name].why_open, []).append(name)
    return [f"{', '.join(names)}: {why}" for why, names in by_reason.items()]


def _line(what: str, estimate: Estimate, unit: str = "") -> str:
    """A value with as many decimals as its standard deviation tells."""
    if not math.isfinite(estimate.sigma):
        return f"{what}: unknown"
    decimals = max(1 - math.floor(math.log10(estimate.sigma)), 0) if estimate.sigma > 0 else 6
    shown = f"{round(estimate.value, decimals) + 0.0:.{decimals}f} ± {estimate.sigma:.{decimals}f}"
    recorded = "" if estimate.recorded is None else f" (file: {estimate.recorded:.4g})"
    return f"{what} {shown}{'' if unit[:1] in ('°', '') else ' '}{unit}{recorded}"


def _times(estimate: Estimate, factor: float) -> Estimate:
    """An estimate in another unit."""
    recorded = None if estimate.recorded is None else estimate.recorded * factor
    value, sigma = estimate.value * factor, estimate.sigma * factor
    return dataclasses.replace(estimate, value=value, sigma=sigma, recorded=recorded)


def _value_facts(name: str, estimate: Estimate) -> dict[str, Any]:
    shown = _times(estimate, DEGREES) if name in ANGLE_VALUES else estimate
    return {
        "value": _rounded(shown.value),
        "sigma": _rounded(shown.sigma) if math.isfinite(shown.sigma) else None,
        "recorded": None if shown.recorded is None else _rounded(shown.recorded),
        "unit": VALUE_UNITS.get(name),
        "why_open": estimate.why_open or None,
    }


def _rounded(value: float) -> float:
    return float(f"{value:.6g}") + 0.0
