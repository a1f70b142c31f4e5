"""A result measured against relations, a reference trajectory, or both."""

from __future__ import annotations

from dataclasses import replace

from nscan_cli.evaluation.evaluation_report import Evaluation
from nscan_cli.evaluation.load_trajectory import load_reference, load_trajectory
from nscan_cli.evaluation.reference_relations import read_relations, relation_errors
from nscan_cli.evaluation.remarks import remarks
from nscan_cli.evaluation.trajectory_errors import trajectory_errors
from nscan_cli.files.inputs import base_name, label
from nscan_cli.logs.reading_options import ReadingOptions


def evaluate_result(
    result: str,
    relations: str | None,
    reference: str | None,
    worst: int = 0,
    reading: ReadingOptions = ReadingOptions(),
    reference_topic: str | None = None,
) -> Evaluation:
    """The errors of the file `result`, and its `worst` relations.

    `reference_topic` is the topic of the poses when the reference is a recording.

    Raises InputMissingError, InputDataError, and WrongUsageError where the options do not fit a log.
    """
    notices: list[str] = []
    trajectory = load_trajectory(result, reading, notices)
    found = Evaluation(base_name(result), trajectory, worst=worst)
    if relations is not None:
        table = read_relations(relations)
        found = replace(found, relations=(table, relation_errors(trajectory, table, label(result))))
    if reference is not None:
        truth = load_reference(reference, reading, notices, reference_topic)
        errors = trajectory_errors(trajectory, truth, label(result), label(reference))
        said = tuple(remarks(trajectory, truth, errors))
        found = replace(found, reference=(base_name(reference), truth, errors), remarks=said)
    return replace(found, notices=tuple(notices))
