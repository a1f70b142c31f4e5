"""`nscan-cli calibrate`: what the scans of a drive say about the robot and its file."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import TYPE_CHECKING, Any

from nscan_cli.cli.compilation import Compiling
from nscan_cli.cli.robot_toml import changed_flags, robot_table, robot_toml
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.standard_streams import print_result
from nscan_cli.cli.subcommand import PATH, log_argument, option, subcommand
from nscan_cli.cli.summary import Row, summary_table
from nscan_cli.files.outputs import check_writable, write_atomically
from nscan_cli.files.text import counted, json_bytes
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.calibration.estimate import Estimate
    from nscan_cli.calibration.robot_calibration import Calibration

ANGLE_VALUES = ("mount_angle", "veer")
"""Values in rad, or rad/m, that are printed in degrees."""
VALUE_UNITS = {
    "mount_x": "m",
    "mount_y": "m",
    "mount_angle": "degrees",
    "veer": "degrees/m",
    "wheel_difference": "1/m",
    "clock_offset": "s",
}
"""The other values have none."""


@subcommand(
    "calibrate",
    ("nscan-cli calibrate drive.mcap", "mounting, odometry and clocks from the scans"),
    ("nscan-cli calibrate drive.mcap -o robot.toml", "as options for --config of all commands"),
    ("nscan-cli calibrate drive.mcap --json", "for a program"),
)
@log_argument()
@option("-o", "--output", type=PATH, metavar="ROBOT.toml",
        help="Also write the options for --config of all commands.")  # fmt: skip
@option("--json", "as_json", is_flag=True, help="Print one JSON object (m, s, degrees).")
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
    """Find from an ordinary drive how the laser is mounted, and what odometry and clocks do.

    Steps from scan to scan, matched without odometry, are compared with the same steps by odometry. Every
    value has its standard deviation, and what the file says beside it. A drive has to have turns, and more in
    view than bare walls. What it leaves open is listed.
    """
    if output is not None:
        check_writable(output)
    from nscan_cli.calibration.calibrated_reading import calibrated_reading
    from nscan_cli.calibration.options import CalibrationOptions
    from nscan_cli.calibration.robot_calibration import calibrate
    from nscan_cli.kernels.decorators import load_runtime
    from nscan_cli.logs.load import read_log

    load_runtime()
    Compiling("half a minute", quiet)
    options, scans = CalibrationOptions(), read_log(log, reading)
    calibration = calibrate(scans, reading, options)
    calibrated = calibrated_reading(calibration, reading, options)
    if as_json:
        facts = _facts(calibration, calibrated) | {"file": scans.source.name, "sha256": scans.source.sha256}
        text = json.dumps(facts, ensure_ascii=False, allow_nan=False)
        write_atomically("-", json_bytes(f"{text}\n"))
    else:
        print_result(f"{summary_table(_rows(calibration, reading, calibrated))}\n")
    if output is not None:
        write_atomically(output, robot_toml(calibrated).encode())


def _rows(calibration: Calibration, reading: ReadingOptions, calibrated: ReadingOptions) -> list[Row]:
    evidence, values = calibration.evidence, calibration.values
    noise, turn_noise = values["noise_distance"], values["noise_turn"]
    measured = (
        f"{evidence.measured} of {counted(evidence.sampled, 'step')} measured, {evidence.turns} with a turn"
    )
    order = "in the wrong order: mirrored" if calibration.mirrored else "in the order of the file"
    flags = changed_flags(reading, calibrated)
    return [
        ("steps", [f"{measured}; {evidence.distance:.1f} m and {evidence.turned:.1f} rad"]),
        ("readings", [order]),
        ("mounting", [_line("x", values["mount_x"], "m"), _line("y", values["mount_y"], "m"),
                      _line("turned by", _degrees(values["mount_angle"]), "°")]),
        ("odometry", [_line("scale", values["odometry_scale"]),
                      _line("turns by odometry / turns by scans", values["turn_ratio"]),
                      _line("heading drift", _degrees(values["veer"]), "°/m")]),
        ("wheels", [_line("right larger than left by", _percent(values["wheel_difference"]),
                          "% per metre of track width"),
                    _line("track width / that of odometry", values["track_width"])]),
        ("noise", [_line("per metre driven", noise, "m/m"),
                   _line("per radian turned", turn_noise, "rad/rad")]),
        ("clock", [_line("to add to odometry's stamps", values["clock_offset"], "s")]),
        ("unknown", _unknown(calibration) or ["nothing"]),
        ("options", [flags or "none: the file agrees with the scans"]),
    ]  # fmt: skip


def _unknown(calibration: Calibration) -> list[str]:
    """The values that the drive leaves open, and why, one line for each reason."""
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


def _degrees(estimate: Estimate) -> Estimate:
    """An angle in degrees."""
    recorded = None if estimate.recorded is None else math.degrees(estimate.recorded)
    value, sigma = math.degrees(estimate.value), math.degrees(estimate.sigma)
    return dataclasses.replace(estimate, value=value, sigma=sigma, recorded=recorded)


def _percent(estimate: Estimate) -> Estimate:
    """A share in percent; what the file says of it is nothing."""
    return dataclasses.replace(
        estimate, value=100.0 * estimate.value, sigma=100.0 * estimate.sigma, recorded=None
    )


def _facts(calibration: Calibration, calibrated: ReadingOptions) -> dict[str, Any]:
    """The object that `calibrate --json` prints, in m, s and degrees. Its keys are always the same."""
    evidence, values = calibration.evidence, {}
    for name, estimate in calibration.values.items():
        shown = _degrees(estimate) if name in ANGLE_VALUES else estimate
        values[name] = {
            "value": _rounded(shown.value),
            "sigma": _rounded(shown.sigma) if math.isfinite(shown.sigma) else None,
            "recorded": None if shown.recorded is None else _rounded(shown.recorded),
            "unit": VALUE_UNITS.get(name),
            "why_open": estimate.why_open or None,
        }
    return {
        "steps": {
            "sampled": evidence.sampled,
            "measured": evidence.measured,
            "with_turn": evidence.turns,
            "distance": _rounded(evidence.distance),
            "turned": _rounded(math.degrees(evidence.turned)),
        },
        "mirrored": calibration.mirrored,
        "values": values,
        "open": calibration.open,
        "options": robot_table(calibrated),
    }


def _rounded(value: float) -> float:
    """With six significant digits."""
    return float(f"{value:.6g}") + 0.0
