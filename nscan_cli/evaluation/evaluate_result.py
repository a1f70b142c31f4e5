"""A result measured against relations, a reference trajectory, or both."""

from __future__ import annotations

from dataclasses import dataclass

from nscan_cli.evaluation.evaluation_report import Evaluation
from nscan_cli.evaluation.load_trajectory import load_reference, load_trajectory
from nscan_cli.evaluation.reference_relations import read_relations, relation_errors
from nscan_cli.evaluation.remarks import remarks
from nscan_cli.evaluation.trajectory_errors import trajectory_errors
from nscan_cli.files.inputs import base_name, label
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.logs.reading_options import ReadingOptions


@dataclass(frozen=True)
class EvaluatedResult:
    """An evaluation, and the trajectories that it was made from."""

    evaluation: Evaluation
    trajectory: Trajectory
    reference: Trajectory | None
    notices: tuple[str, ...] = ()
    """Warnings from reading the files."""


def evaluate_result(
    result: str,
    relations: str | None,
    reference: str | None,
    worst: int = 0,
    reading: ReadingOptions = ReadingOptions(),
    reference_topic: str | None = None,
) -> EvaluatedResult:
    """The errors of the file `result`, and its `worst` relations.

    `reference_topic` is the topic of the poses when the reference is a recording.

    Raises InputMissingError, InputDataError, and WrongUsageError where the options do not fit a log.
    """
    notices: list[str] = []
    trajectory = load_trajectory(result, reading, notices)
    on_relations, on_reference, truth = None, None, None
    found: tuple[str, ...] = ()
    if relations is not None:
        table = read_relations(relations)
        on_relations = (table, relation_errors(trajectory, table, label(result)))
    if reference is not None:
        truth = load_reference(reference, reading, notices, reference_topic)
        errors = trajectory_errors(trajectory, truth, label(result), label(reference))
        on_reference = (base_name(reference), errors)
        found = tuple(remarks(trajectory, truth, errors))
    evaluation = Evaluation(base_name(result), len(trajectory), on_relations, on_reference, worst, found)
    return EvaluatedResult(evaluation, trajectory, truth, tuple(notices))
