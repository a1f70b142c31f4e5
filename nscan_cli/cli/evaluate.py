"""`nscan-cli evaluate`: errors of a result against reference relations or a reference trajectory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from nscan_cli.cli.plot_option import check_plot, plot_option, write_plot
from nscan_cli.cli.progress import say
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.standard_streams import print_result
from nscan_cli.cli.subcommand import PATH, argument, json_option, option, subcommand
from nscan_cli.errors import CheckFailedError, WrongUsageError
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.evaluation.evaluation_report import Evaluation

DEFAULT_DRAWN = 10
"""Number of worst relations in a picture without --worst."""


@subcommand(
    "evaluate",
    (
        "nscan-cli evaluate intel.json --relations intel.relations --worst 5",
        "against relations of a benchmark",
    ),
    ("nscan-cli evaluate robot.json --reference truth.tum --plot errors.png", "against a trajectory"),
    (
        "nscan-cli evaluate robot.json --reference robot.log.gz --max-translation 0.05",
        "as a test: exit code 3 if it fails",
    ),
)
@argument("result", type=PATH, tells="A graph, a TUM trajectory, or a CARMEN log with corrected poses; - is "
          "standard input.")  # fmt: skip
@option("--relations", type=PATH, metavar="FILE", help="Relations of the benchmark of Kümmerle et al. 2009.")
@option("--reference", type=PATH, metavar="FILE",
        help="A trajectory (TUM, or EuRoC's CSV), a graph, a log with TRUEPOS, or a recording.")  # fmt: skip
@option("--reference-topic", metavar="TOPIC",
        help="Topic of the poses in a recording given as --reference, such as /vicon/robot/pose, or "
        "/tf:PARENT.CHILD for transforms.")  # fmt: skip
@option("--worst", type=click.IntRange(0), metavar="N", help="List the N worst relations.")
@option("--max-translation", type=click.FloatRange(0), metavar="M",
        help="Exit with code 3 if the mean error (relations) or RMSE (ATE) is larger.")  # fmt: skip
@option("--max-rotation", type=click.FloatRange(0), metavar="DEG",
        help="Exit with code 3 if the rotational error is larger.")  # fmt: skip
@json_option
@plot_option("the worst relations (10, or N) over the trajectory, or the error along the reference")
@reading_options
@common_options
def command(
    result: str,
    relations: str | None,
    reference: str | None,
    reference_topic: str | None,
    worst: int | None,
    max_translation: float | None,
    max_rotation: float | None,
    as_json: bool,
    plot: str | None,
    reading: ReadingOptions,
    quiet: bool,
    **_verbosity: int,
) -> None:
    """Compare RESULT with reference relations or a reference trajectory.

    With --relations, relative poses of pairs of stamps are compared, without a common frame: translational
    and rotational error, mean ± sd, median, mean square and maximum. With --reference, the trajectory is
    aligned first, then the absolute error (ATE) and the relative error (RPE) per metre of path are computed.
    The options of reading a log apply if RESULT or the reference is a log.

    Notes report other differences: clocks, units, turned frames, a reference at another point of the robot or
    out of the plane, two runs in one file.
    """
    if relations is None and reference is None:
        raise WrongUsageError("there is no reference; give --relations or --reference")
    if reference is None and reference_topic is not None:
        raise WrongUsageError("--reference-topic needs a recording as the reference; give --reference, too")
    if [result, relations, reference].count("-") > 1:
        raise WrongUsageError("standard input (-) can be one input only; give the others by their path")
    check_plot(plot, [result, relations, reference])
    import json

    from nscan_cli.evaluation.evaluate_result import evaluate_result
    from nscan_cli.evaluation.evaluation_report import as_document, evaluation_text

    evaluation = evaluate_result(result, relations, reference, worst or 0, reading, reference_topic)
    for notice in evaluation.notices:
        say(f"warning: {notice}", quiet)
    if evaluation.relations and evaluation.relations[1].too_far:
        table, errors = evaluation.relations
        say(f"warning: a stamp is far from every pose in {errors.too_far} of {len(table)} relations", quiet)
    for remark in evaluation.remarks:
        say(f"note: {remark}", quiet)
    if as_json:
        print_result(json.dumps(as_document(evaluation), indent=2, allow_nan=False) + "\n")
    else:
        print_result(evaluation_text(evaluation))
    if plot is not None:
        from nscan_cli.evaluation.error_picture import picture

        write_plot(plot, picture(evaluation, DEFAULT_DRAWN if worst is None else worst))
    _check_bounds(evaluation, max_translation, max_rotation)


def _check_bounds(evaluation: Evaluation, max_translation: float | None, max_rotation: float | None) -> None:
    above = []
    for name, translation, rotation in evaluation.bounded():
        if max_translation is not None and translation > max_translation:
            above.append(f"{name}: {translation:.4f} m is above {max_translation:g} m")
        if max_rotation is not None and rotation > max_rotation:
            above.append(f"{name}: {rotation:.4f} degrees is above {max_rotation:g} degrees")
    if above:
        raise CheckFailedError(f"{evaluation.result}: " + "; ".join(above))
