"""`nscan-cli nscan`: the joint match of n scans."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import TYPE_CHECKING, Any

import click

from nscan_cli.cli.compilation import Compiling
from nscan_cli.cli.match import match_document, weakest_record, with_defaults
from nscan_cli.cli.picture_names import check_document_name
from nscan_cli.cli.plot_option import check_plot, plot_option, write_plot
from nscan_cli.cli.progress import say
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.subcommand import PATH, Parsed, log_argument, option, result_option, subcommand
from nscan_cli.cli.summary import Row, match_outcome, summary_table
from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.outputs import check_writable, write_atomically
from nscan_cli.files.provenance import as_parameters, provenance_of
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.matching.joint.index_set import IndexSetKind
    from nscan_cli.matching.joint.nscan_match import NScanMatch
    from nscan_cli.matching.joint.outliers import ExcludedScan
    from nscan_cli.matching.uncertainty import Weakest

NSCAN_FORMAT = "nscan-joint-match"
INITIAL_WORDS, PRIOR_WORDS = ("odometry", "identity"), ("odometry", "none")
"""Words in --initial and in --prior that are not files."""
LISTED_SCANS = 6
"""Most scans with a weak direction that the summary lists; the result has all."""
SPEC_PART = re.compile(r"(\d+)(?:-(\d+)(?::(\d+))?)?")
MOST_SCANS = 500
"""The Hessian grows with the square of the number of scans; a longer list is taken for a typing error."""


def scans_from(text: str) -> tuple[int, ...]:
    """The scan numbers of a text such as `10,12,14-20` or `100-190:10`.

    Raises ValueError for another form, a single scan and a repeated scan.
    """
    scans: list[int] = []
    for part in text.split(","):
        match = SPEC_PART.fullmatch(part.strip())
        if match is None:
            raise ValueError(f"{part!r} is not of the form 10, 14-20 or 100-190:10")
        first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
        if last < first:
            raise ValueError(f"{part!r} runs backwards")
        if step == 0:
            raise ValueError(f"{part!r} has a step of 0")
        chosen = range(first, last + 1, step)
        if len(chosen) > MOST_SCANS - len(scans):
            raise ValueError(f"{text!r} has more than {MOST_SCANS} scans")
        scans += chosen
    if len(scans) < 2:
        raise ValueError(f"{text!r} has only one scan; give two or more")
    if len(set(scans)) < len(scans):
        twice = next(scan for at, scan in enumerate(scans) if scan in scans[:at])
        raise ValueError(f"{text!r} has scan {twice} twice")
    return tuple(scans)


@subcommand(
    "nscan",
    ("nscan-cli nscan robot.log.gz --scans 100-190:10 -o nscan.json --plot nscan.png", "ten scans"),
    (
        "nscan-cli nscan robot.log.gz --scans 10,12,200 --initial robot.json --prior robot.json",
        "with initial poses and priors from a graph",
    ),
)
@log_argument()
@option("--scans", "numbers", type=Parsed("SPEC", scans_from), required=True,
        help="Numbers of the scans to match, such as 10,12,14-20 or 100-190:10.")  # fmt: skip
@option("--pairs", type=click.Choice(["all", "visible", "overlap"]), default="overlap", show_default=True,
        help="Pairs of scans to match: all, those of which one saw the other's position (visible), or those "
        "that overlap.")  # fmt: skip
@option("--gauge", type=click.Choice(["free", "fixed"]), default="free", show_default=True,
        help="Estimate all poses by steps of least norm (free), or keep one scan fixed.")  # fmt: skip
@option("--fixed", type=click.IntRange(0), metavar="K",
        help="The scan that --gauge fixed keeps, and that the covariance is relative to. Default: the "
        "first of SPEC.")  # fmt: skip
@option("--initial", type=PATH, metavar="odometry|identity|GRAPH.json|TRAJECTORY.tum",
        help="Initial poses. Default: odometry, or identity if there is none.")  # fmt: skip
@option("--prior", type=PATH, metavar="odometry|none|GRAPH.json",
        help="Priors of relative poses, from odometry or a graph. Default: odometry, or none if there is "
        "none.")  # fmt: skip
@result_option
@plot_option("all scans before and after the match, with circles at their poses")
@reading_options
@common_options
def command(
    log: tuple[str, ...],
    numbers: tuple[int, ...],
    pairs: IndexSetKind,
    gauge: str,
    fixed: int | None,
    initial: str | None,
    prior: str | None,
    output: str,
    plot: str | None,
    reading: ReadingOptions,
    quiet: bool,
    **_verbosity: int,
) -> None:
    """Match several scans of LOG jointly (nScan-Matching). Also called match-jointly.

    The result is an nScan relation: local poses and their Hessian, gauge included, with the covariance
    relative to one scan. Scans that overlap no other scan, or contradict their priors, are left out and
    reported. Scans with a weak direction, as along a corridor, are reported, too.
    """
    if fixed is not None and fixed not in numbers:
        raise WrongUsageError(f"--fixed {fixed}: is not one of the scans to match; choose one of them")
    if "-" in log and "-" in (initial, prior):
        raise WrongUsageError("standard input (-) can be one input only; give the others by their path")
    check_document_name(output, "the result in JSON", "give --plot PICTURE.png for a picture")
    check_writable(output)
    files = [path for path, words in ((initial, INITIAL_WORDS), (prior, PRIOR_WORDS)) if path not in words]
    from nscan_cli.logs.log_files import files_of

    check_plot(plot, [output, *files_of(log), *files])
    from nscan_cli.cli.initial_and_priors import initial_and_priors
    from nscan_cli.files.inputs import base_name
    from nscan_cli.graph.relative_covariance import AttachmentOptions
    from nscan_cli.logs.load import read_log
    from nscan_cli.matching.joint.nscan_match import nscan_match
    from nscan_cli.matching.joint.options import JointOptions
    from nscan_cli.matching.motion_model import MotionModel
    from nscan_cli.matching.pairwise import PairOptions, matched_points

    Compiling("up to half a minute", quiet)
    scans = read_log(log, reading).moving_along(None)
    rows = [scans.row(number) for number in numbers]
    initial, prior = with_defaults(scans, rows, initial, prior, quiet)
    options, model = PairOptions(), MotionModel()
    joint = JointOptions(fixed=0 if gauge == "fixed" else None)
    start, priors, sources = initial_and_priors(scans, numbers, initial, prior, model)
    if prior not in PRIOR_WORDS and not len(priors(range(len(numbers))).pairs):
        say(f"warning: {prior} has no relation between these scans", quiet)
    points = [matched_points(scans, row, options) for row in rows]
    held = 0 if fixed is None else numbers.index(fixed)
    match, left_out = nscan_match(points, start, priors, held, options, joint, pairs)
    if match is None:
        why = "; ".join(_left_out_lines(numbers, left_out))
        remedy = "choose scans that see the same walls, or another --initial"
        raise InputDataError(scans.source.name, f"no two of the scans match: {why}", remedy)
    parameters = {
        "reading": dataclasses.asdict(reading),
        "matching": as_parameters(options),
        "joint": {key: value for key, value in as_parameters(joint).items() if key != "fixed"},
        "pairs": pairs,
        "gauge": gauge,
        "initial": base_name(initial),
        "prior": base_name(prior),
        "odometry": as_parameters(model),
        "attachment": as_parameters(AttachmentOptions()),
    }
    provenance = provenance_of([scans.source, *sources], parameters)
    write_atomically(output, match_document(NSCAN_FORMAT, provenance, _fields(numbers, match, left_out)))
    if plot is not None:
        from nscan_cli.mapping.figures.match_plots import plot_nscan

        write_plot(plot, plot_nscan(numbers, points, start, match, left_out))
    say(summary_table(_nscan_rows(numbers, match, left_out)), quiet)


def _fields(numbers: tuple[int, ...], match: NScanMatch, left_out: list[ExcludedScan]) -> dict[str, Any]:
    """The fields of the result."""
    from nscan_cli.graph.io.json_fields import rounded_upper_triangle, six_digits
    from nscan_cli.graph.model import NScan
    from nscan_cli.graph.relations.registry import relation_record
    from nscan_cli.graph.relations.semidefinite import WRITTEN_ROUNDING, as_information

    kept = [numbers[scan] for scan in match.kept]
    joint = match.joint
    score = float(match.overlap.min())
    # Along the gauge it is 0 except for rounding.
    information = as_information(joint.hessian, WRITTEN_ROUNDING)
    relation = NScan(tuple(kept), match.poses, information, match.fixed, "nscan", score)
    return {
        "relation": relation_record(relation, "scans"),
        "covariance": None if match.covariance is None else rounded_upper_triangle(match.covariance),
        "energy": six_digits(match.energy),
        "gradient_norm": six_digits(joint.gradient_norm),
        "decrement": None if match.decrement is None else six_digits(match.decrement),
        "iterations": joint.iterations,
        "evaluations": joint.evaluations,
        "unsettled_stages": joint.unsettled,
        "searched": joint.searched,
        "converged": match.reason is None,
        "reason": match.reason,
        "pairs": [[kept[i], kept[j]] for i, j in match.pairs.tolist()],
        "overlap": [six_digits(share) for share in match.overlap.tolist()],
        "weakest": [weakest_record(weakest) for weakest in match.weakest],
        "left_out": [
            {
                "scan": numbers[out.scan],
                "reason": out.reason,
                "overlap": six_digits(out.overlap),
                "chi2": None if out.chi2 is None else six_digits(out.chi2),
            }
            for out in left_out
        ],
    }


def _nscan_rows(numbers: tuple[int, ...], match: NScanMatch, left_out: list[ExcludedScan]) -> list[Row]:
    joint = match.joint
    weak = [
        _weakly_held_line(numbers[scan], weakest)
        for scan, weakest in zip(match.kept, match.weakest, strict=True)
        if weakest.is_weak
    ]
    more = [f"and {len(weak) - LISTED_SCANS} more"] if len(weak) > LISTED_SCANS else []
    searched = "by search: the match from the initial poses was worse"
    return [
        ("scans", [f"{len(match.kept)} of {len(numbers)}, matched in {counted(len(match.pairs), 'pair')}"]),
        ("overlap", [f"{match.overlap.min():.0%} at least"]),
        ("match", match_outcome(match.reason, joint.iterations, joint.evaluations, joint.unsettled)),
        ("placed", [searched] if joint.searched else []),
        ("weak", [*weak[:LISTED_SCANS], *more]),
        ("left out", _left_out_lines(numbers, left_out)),
    ]


def _weakly_held_line(number: int, weakest: Weakest) -> str:
    known = "open" if weakest.sigma is None else f"σ {weakest.sigma:.2g} m"
    return f"scan {number} along {math.degrees(weakest.direction):.0f}° ({known})"


def _left_out_lines(numbers: tuple[int, ...], left_out: list[ExcludedScan]) -> list[str]:
    return [f"scan {numbers[out.scan]} {out.reason}" for out in left_out]
