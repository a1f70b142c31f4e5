"""`nscan-cli match`: the relative pose of two scans, with its covariance."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from nscan_cli.cli.compilation import Compiling
from nscan_cli.cli.picture_names import check_document_name
from nscan_cli.cli.plot_option import check_plot, plot_option, write_plot
from nscan_cli.cli.progress import say
from nscan_cli.cli.shared_options import common_options, pose_from, reading_options
from nscan_cli.cli.subcommand import Parsed, log_argument, option, result_option, subcommand
from nscan_cli.cli.summary import Row, match_outcome, summary_table
from nscan_cli.errors import WrongUsageError
from nscan_cli.files.outputs import check_writable, write_atomically
from nscan_cli.files.provenance import as_parameters, provenance_of
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.matching.pairwise import PairMatch
    from nscan_cli.matching.uncertainty import Weakest
    from nscan_cli.poses import Array

MATCH_FORMAT = "nscan-match"


def _start_from(text: str) -> str:
    """odometry, identity or X,Y,DEG, as typed."""
    if text not in ("odometry", "identity"):
        try:
            pose_from(text)
        except ValueError as error:
            raise ValueError(f"{error}, nor odometry or identity") from error
    return text


@subcommand(
    "match",
    ("nscan-cli match robot.log.gz --reference 100 --scan 105", "scan 105 in the frame of scan 100"),
    (
        "nscan-cli match robot.log.gz --reference 100 --scan 105 --prior none -o match.json --plot match.png",
        "without odometry as a prior, with a picture",
    ),
)
@log_argument()
@option("--reference", type=click.IntRange(0), required=True, metavar="I",
        help="Number of the reference scan, which stays fixed.")  # fmt: skip
@option("--scan", type=click.IntRange(0), required=True, metavar="J",
        help="Number of the scan that is moved.")  # fmt: skip
@option("--initial", type=Parsed("start", _start_from), metavar="odometry|identity|X,Y,DEG",
        help="Initial pose of J in the frame of I (m, degrees). Default: odometry, or identity if there is "
        "none.")  # fmt: skip
@option("--prior", type=click.Choice(["odometry", "none"]),
        help="Prior of the relative pose. Default: odometry, or none if there is none.")  # fmt: skip
@result_option
@plot_option("both scans before and after the match, with the uncertainty")
@reading_options
@common_options
def command(
    log: tuple[str, ...],
    reference: int,
    scan: int,
    initial: str | None,
    prior: str | None,
    output: str,
    plot: str | None,
    reading: ReadingOptions,
    quiet: bool,
    **_verbosity: int,
) -> None:
    """Match two scans of LOG (NDT), and report their relative pose with its covariance.

    The result is the pose of scan J in the frame of scan I (m, rad), with energy, Hessian and covariance.
    A direction that the scans do not determine, as along a corridor, shows as the weakest direction, most
    clearly with --prior none.
    """
    check_document_name(output, "the result in JSON", "give --plot PICTURE.png for a picture")
    check_writable(output)
    from nscan_cli.logs.log_files import files_of

    check_plot(plot, [output, *files_of(log)])
    from nscan_cli.logs.load import read_log
    from nscan_cli.matching.motion_model import MotionModel, odometry_prior
    from nscan_cli.matching.pairwise import PairOptions, match_pair, matched_points, scan_ndt

    Compiling("up to half a minute", quiet)
    scans = read_log(log, reading).moving_along(None)
    rows = scans.row(reference), scans.row(scan)
    initial, prior = with_defaults(scans, rows, initial, prior, quiet)
    options, model = PairOptions(), MotionModel()
    start = _initial_pose(scans, rows, initial)
    known = None
    if prior == "odometry" and scans.odometry is not None:
        known = odometry_prior(scans.odometry[rows[0]], scans.odometry[rows[1]], model)
    fixed, moving = (matched_points(scans, row, options) for row in rows)
    match = match_pair(scan_ndt(fixed, options), moving, start, known, options)
    parameters = {
        "reading": dataclasses.asdict(reading),
        "matching": as_parameters(options),
        "prior": prior,
        "odometry": as_parameters(model),
    }
    write_atomically(output, _document(scans, (reference, scan), start, match, parameters))
    if plot is not None:
        from nscan_cli.mapping.figures.match_plots import plot_match

        write_plot(plot, plot_match((reference, scan), fixed, moving, start, match))
    say(summary_table(_match_rows(reference, scan, match)), quiet)


def with_defaults(
    log: LaserLog, rows: Sequence[int], initial: str | None, prior: str | None, quiet: bool
) -> tuple[str, str]:
    """`initial` and `prior`, with odometry as the default if the scans in `rows` have it.

    Raises WrongUsageError if odometry was requested and the log has none, or one of the scans.
    """
    from nscan_cli.poses import are_known

    missing = [] if log.odometry is None else [row for row in rows if not are_known(log.odometry[row])]
    if log.odometry is not None and not missing:
        return initial or "odometry", prior or "odometry"
    where = f" at scan {log.numbers[missing[0]]}" if missing else ""
    for name, value, other in (("--initial", initial, "identity"), ("--prior", prior, "none")):
        if value == "odometry":
            raise WrongUsageError(f"{log.source.name}: has no odometry{where}; give {name} {other}")
    if initial is None or prior is None:
        say(f"no odometry{where}: initial {initial or 'identity'}, prior {prior or 'none'}", quiet)
    return initial or "identity", prior or "none"


def _initial_pose(log: LaserLog, rows: tuple[int, int], initial: str) -> Array:
    """The initial relative pose (3,)."""
    import numpy as np

    from nscan_cli.poses import relative

    if initial == "odometry" and log.odometry is not None:
        return relative(log.odometry[rows[1]], log.odometry[rows[0]])
    if initial == "identity":
        return np.zeros(3)
    return np.array(pose_from(initial))


def match_document(name: str, provenance: dict[str, Any], fields: dict[str, Any]) -> bytes:
    """The JSON document of format `name`: one key a line in fixed order, no NaN, a final line feed."""
    units = {"length": "m", "angle": "rad"}
    head = {"format": name, "version": "1.0", "units": units, "provenance": provenance}
    lines = [
        f'"{key}":{json.dumps(value, separators=(",", ":"), allow_nan=False)}'
        for key, value in {**head, **fields}.items()
    ]
    return ("{" + ",\n".join(lines) + "}\n").encode()


def weakest_record(weakest: Weakest) -> dict[str, Any]:
    """The JSON object of the direction that is known least."""
    from nscan_cli.graph.io.json_fields import six_digits

    sigma = None if weakest.sigma is None else six_digits(weakest.sigma)
    return {"direction": six_digits(weakest.direction), "sigma": sigma}


def _document(
    log: LaserLog, numbers: tuple[int, int], start: Array, match: PairMatch, parameters: dict[str, Any]
) -> bytes:
    from nscan_cli.graph.io.json_fields import pose_rows, rounded_upper_triangle, six_digits

    return match_document(
        MATCH_FORMAT,
        provenance_of([log.source], parameters),
        {
            "reference": numbers[0],
            "scan": numbers[1],
            "initial": pose_rows(start[None])[0],
            "pose": pose_rows(match.pose[None])[0],
            "energy": six_digits(match.energy),
            "gradient_norm": six_digits(match.gradient_norm),
            "decrement": None if match.decrement is None else six_digits(match.decrement),
            "hessian": rounded_upper_triangle(match.hessian),
            "covariance": None if match.covariance is None else rounded_upper_triangle(match.covariance),
            "eigenvalues": [six_digits(value) for value in match.eigenvalues.tolist()],
            "weakest": weakest_record(match.weakest),
            "overlap": six_digits(match.overlap),
            "iterations": match.iterations,
            "evaluations": match.evaluations,
            "unsettled_stages": match.unsettled,
            "converged": match.converged,
            "reason": match.reason,
        },
    )


def _match_rows(reference: int, scan: int, match: PairMatch) -> list[Row]:
    import numpy as np

    x, y, angle = match.pose.tolist()
    weakest = match.weakest
    if match.covariance is None:
        known = "unknown"
    else:
        sigmas = np.sqrt(np.diag(match.covariance))
        known = f"{sigmas[0]:.2g} m, {sigmas[1]:.2g} m, {math.degrees(sigmas[2]):.2g}°"
    least = "open" if weakest.sigma is None else f"σ {weakest.sigma:.2g} m"
    along = f"along {math.degrees(weakest.direction):.1f}° from scan {reference}'s x axis"
    # Adding 0.0 turns −0 into 0.
    return [
        ("scan", [f"{scan} in the frame of scan {reference}"]),
        ("pose", [f"{round(x, 3) + 0.0:.3f} m, {round(y, 3) + 0.0:.3f} m, "
                  f"{round(math.degrees(angle), 2) + 0.0:.2f}°"]),
        ("sigma", [known]),
        ("weakest", [f"{least} {along}"]),
        ("overlap", [f"{match.overlap:.0%}"]),
        ("match", match_outcome(match.reason, match.iterations, match.evaluations, match.unsettled)),
    ]  # fmt: skip
