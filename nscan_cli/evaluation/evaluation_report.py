"""An evaluation for people (a table of at most 80 columns) and for scripts (JSON)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from nscan_cli.evaluation.alignment import Alignment
from nscan_cli.evaluation.options import EvaluationOptions
from nscan_cli.evaluation.reference_relations import ReferenceRelations, RelationErrors
from nscan_cli.evaluation.statistics import Spread
from nscan_cli.evaluation.trajectory_errors import TrajectoryErrors
from nscan_cli.files.provenance import as_parameters
from nscan_cli.files.text import counted
from nscan_cli.graph.io.tum import Trajectory

ERROR_UNITS = {"translation": "m", "rotation": "deg", "time": "s"}


@dataclass(frozen=True)
class Evaluation:
    """A result measured against relations, a reference trajectory, or both."""

    result: str
    """Base name, as are the names below."""
    trajectory: Trajectory
    relations: tuple[ReferenceRelations, RelationErrors] | None = None
    reference: tuple[str, Trajectory, TrajectoryErrors] | None = None
    worst: int = 0
    """How many of the worst relations are listed."""
    remarks: tuple[str, ...] = ()
    """Sentences on other differences of result and reference (remarks.py)."""
    notices: tuple[str, ...] = ()
    """Warnings from reading the files."""
    options: EvaluationOptions = field(default_factory=EvaluationOptions)

    def bounded(self) -> list[tuple[str, float, float]]:
        """The errors that limits apply to, as (name, m, degrees): mean on relations, RMSE of the ATE."""
        figures = []
        if self.relations:
            errors = self.relations[1]
            figures.append(("mean on relations", errors.translation_spread.mean, errors.rotation_spread.mean))
        if self.reference:
            ate = self.reference[2]
            figures.append(("RMSE of the ATE", ate.absolute_translation.rmse, ate.absolute_rotation.rmse))
        return figures


def evaluation_text(evaluation: Evaluation) -> str:
    """The tables, with a final line feed."""
    blocks = [f"result     {evaluation.result}: {counted(len(evaluation.trajectory), 'pose')}"]
    if evaluation.relations:
        relations, errors = evaluation.relations
        near, tolerance = len(errors.used) - errors.exact, evaluation.options.tolerance
        blocks.append(
            f"relations  {relations.name}: {len(errors.used)} of {len(relations)} used, "
            f"{errors.exact} at exact stamps,\n"
            f"           {near} within {tolerance} s; {errors.too_far} not used, because no pose is near\n\n"
            + _statistics_table(
                {"translation, m": errors.translation_spread, "rotation, deg": errors.rotation_spread}
            )
        )
        if evaluation.worst:
            blocks.append(_worst_table(evaluation))
    if evaluation.reference:
        name, _truth, errors_ = evaluation.reference
        distance = evaluation.options.relative_distance
        rows = {
            "ATE, m": errors_.absolute_translation,
            "ATE, deg": errors_.absolute_rotation,
            f"RPE, m per {distance:g} m": errors_.relative_translation,
            f"RPE, deg per {distance:g} m": errors_.relative_rotation,
        }
        blocks.append(
            f"reference  {name}: {errors_.matched} poses match within {evaluation.options.tolerance} s, "
            f"{errors_.unmatched} do not\n{_alignment_note(errors_.alignment)}\n" + _statistics_table(rows)
        )
    return "\n\n".join(blocks) + "\n"


def _alignment_note(alignment: Alignment) -> str:
    if alignment.by == "positions":
        return ""
    return (
        f"alignment  the angle comes from the headings: result and reference move by only\n"
        f"           {alignment.common:.3f} m together, which does not determine it\n"
    )


def as_document(evaluation: Evaluation) -> dict[str, Any]:
    """The evaluation as an object for JSON; lengths in m, angles in degrees, those in its parameters in
    rad."""
    poses = len(evaluation.trajectory)
    document: dict[str, Any] = {"result": evaluation.result, "poses": poses, "units": ERROR_UNITS}
    if evaluation.relations:
        relations, errors = evaluation.relations
        document["relations"] = {
            "name": relations.name,
            "count": len(relations),
            "used": len(errors.used),
            "exact": errors.exact,
            "near": len(errors.used) - errors.exact,
            "too_far": errors.too_far,
            "translation": _statistics_record(errors.translation_spread),
            "rotation": _statistics_record(errors.rotation_spread),
            "worst": _worst_rows(evaluation),
        }
    if evaluation.reference:
        name, _truth, against = evaluation.reference
        document["reference"] = {
            "name": name,
            "matched": against.matched,
            "unmatched": against.unmatched,
            "alignment": _alignment_record(against),
            "ate": {
                "translation": _statistics_record(against.absolute_translation),
                "rotation": _statistics_record(against.absolute_rotation),
            },
            "rpe": {
                "distance": evaluation.options.relative_distance,
                "translation": _statistics_record(against.relative_translation),
                "rotation": _statistics_record(against.relative_rotation),
            },
        }
    document["notes"] = list(evaluation.remarks)
    document["parameters"] = as_parameters(evaluation.options)
    return document


def _alignment_record(errors: TrajectoryErrors) -> dict[str, Any]:
    x, y, angle = errors.alignment.motion.tolist()
    return {
        "translation": [round(x, 9) + 0.0, round(y, 9) + 0.0],
        "rotation": round(math.degrees(angle), 9) + 0.0,
        "rotation_from": errors.alignment.by,
        "pairs": errors.matched,
    }


def _statistics_table(rows: Mapping[str, Spread | None]) -> str:
    """A table with a row for each spread."""
    headings = [each.name.replace("_", " ") for each in fields(Spread)]
    lines = [" " * 18 + "".join(f"{heading:>{_width(heading)}}" for heading in headings)]
    for name, spread in rows.items():
        if spread is None:
            lines.append(f"{name:<18}  none: the matched path is too short")
            continue
        cells = (
            f"{_cell(heading, figure):>{_width(heading)}}"
            for heading, figure in zip(headings, asdict(spread).values(), strict=True)
        )
        lines.append(f"{name:<18}" + "".join(cells))
    return "\n".join(lines)


def _cell(heading: str, figure: float) -> str:
    """At most 10 characters; four decimals are too few for squares of small errors."""
    return f"{figure:.4g}" if heading == "mean square" or figure >= 99_999 else f"{figure:.4f}"


def _width(heading: str) -> int:
    return max(len(heading) + 1, 10)


def _statistics_record(spread: Spread | None) -> dict[str, float] | None:
    return None if spread is None else {name: round(value, 9) for name, value in asdict(spread).items()}


def _worst_rows(evaluation: Evaluation) -> list[dict[str, Any]]:
    assert evaluation.relations is not None
    relations, errors = evaluation.relations
    rows = []
    for position in errors.worst(evaluation.worst).tolist():
        relation = int(errors.used[position])
        rows.append(
            {
                "line": int(relations.lines[relation]),
                "stamps": list(relations.stamps[relation]),
                "translation": round(float(errors.translation[position]), 9),
                "rotation": round(float(errors.rotation[position]), 9),
            }
        )
    return rows


def _worst_table(evaluation: Evaluation) -> str:
    lines = [f"worst relations{'line':>9}{'from':>20}{'to':>20}{'m':>9}{'deg':>7}"]
    for row in _worst_rows(evaluation):
        start, end = row["stamps"]
        lines.append(
            f"{row['line']:>24}{start:>20}{end:>20}{row['translation']:>9.3f}{row['rotation']:>7.1f}"
        )
    return "\n".join(lines)
