"""The error of a trajectory on reference relations.

R. Kümmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27, 2009: the
relative pose of each pair of stamps is compared with the reference's, so that no common frame is needed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.evaluation.options import EvaluationOptions
from nscan_cli.evaluation.statistics import Spread
from nscan_cli.evaluation.time_association import no_match
from nscan_cli.files.inputs import base_name, label, read_text
from nscan_cli.files.limits import DISTANCE, GRAPH, TIME
from nscan_cli.graph.io.pose_columns import numbered_lines, split_fields
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.logs.scan_order import nearest_in_time
from nscan_cli.poses import Array, Indices, relative, wrap

COLUMNS = 8
RELATIONS_FORMAT = "relations are lines 't1 t2 x y z roll pitch yaw'"
SAME_STAMP = 1e-5
"""s; stamps that differ by no more are the same, as relation files have five or six decimals."""
LARGEST_SPATIAL_PART = 1e-6
"""m and rad; larger z, roll or pitch is refused."""


@dataclass(frozen=True)
class ReferenceRelations:
    """Reference relations: the pose at the second stamp in the frame of the pose at the first."""

    name: str
    """Base name of the file."""
    stamps: tuple[tuple[str, str], ...]
    """R pairs as written."""
    times: Array
    """(R, 2) seconds."""
    poses: Array
    """(R, 3)"""
    lines: Indices
    """(R,) line numbers in the file."""

    def __len__(self) -> int:
        return len(self.stamps)


@dataclass(frozen=True)
class RelationErrors:
    """The errors of a trajectory on the relations whose stamps it has."""

    used: Indices
    """(U,) rows of the relations that were used."""
    exact: int
    """How many of them found both stamps in the trajectory."""
    too_far: int
    """How many relations were left out, because no pose is near one of their stamps."""
    rows: Indices
    """(U, 2) rows of the trajectory."""
    translation: Array
    """(U,) m"""
    rotation: Array
    """(U,) degrees"""

    @property
    def translation_spread(self) -> Spread:
        """Statistics of the translational error, m."""
        return Spread.of(self.translation)

    @property
    def rotation_spread(self) -> Spread:
        """Statistics of the rotational error, degrees."""
        return Spread.of(self.rotation)

    def worst(self, count: int) -> Indices:
        """Positions in `used` of the `count` largest translational errors, the largest first."""
        return np.argsort(-self.translation, kind="stable")[:count].astype(np.int64)


def read_relations(path: str) -> ReferenceRelations:
    """The relations of a file; "-" reads standard input.

    Raises InputMissingError when the file cannot be read, InputDataError on a line that is no relation
    of two 2D poses or when there is none.
    """
    stamps: list[tuple[str, str]] = []
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in numbered_lines(read_text(path, GRAPH)):
        fields = split_fields(line)
        if line.startswith("#"):
            continue
        try:
            rows.append(_relation_numbers(fields))
        except ValueError as error:
            raise InputDataError(label(path), str(error), RELATIONS_FORMAT, line=number) from error
        stamps.append((fields[0], fields[1]))
        lines.append(number)
    if not rows:
        raise InputDataError(label(path), "no relation in it", RELATIONS_FORMAT)
    table = np.array(rows)
    return ReferenceRelations(
        base_name(path), tuple(stamps), table[:, :2], table[:, [2, 3, 7]], np.array(lines, dtype=np.int64)
    )


def relation_errors(
    trajectory: Trajectory, relations: ReferenceRelations, name: str = "result"
) -> RelationErrors:
    """The errors of a trajectory; `name` is what a message calls it.

    A stamp takes the nearest pose, at most `tolerance` away in time. With u the relative pose in the
    trajectory and z that of the relation, the errors are ‖(u_x − z_x, u_y − z_y)‖ and |u_φ − z_φ| in degrees.
    Raises InputDataError when no relation can be used.
    """
    rows = nearest_in_time(trajectory.times, relations.times.ravel()).reshape(-1, 2)
    distance = np.abs(trajectory.times[rows] - relations.times).max(axis=1)
    used = np.flatnonzero(distance <= EvaluationOptions.tolerance)
    if len(used) == 0:
        raise no_match(name, trajectory.times, relations.name, relations.times.ravel())
    rows = rows[used]
    u = relative(trajectory.poses[rows[:, 1]], trajectory.poses[rows[:, 0]])
    error = u - relations.poses[used]
    return RelationErrors(
        used=used.astype(np.int64),
        exact=int((distance <= SAME_STAMP).sum()),
        too_far=len(relations) - len(used),
        rows=rows,
        translation=np.hypot(error[:, 0], error[:, 1]),
        rotation=np.degrees(np.abs(wrap(error[:, 2]))),
    )


def _relation_numbers(fields: list[str]) -> list[float]:
    """The numbers of a line. Raises ValueError saying what is wrong."""
    if len(fields) != COLUMNS:
        raise ValueError(f"{len(fields)} columns instead of {COLUMNS}")
    values = [float(field) for field in fields]
    if not all(math.isfinite(value) for value in values):
        raise ValueError("a number is not finite")
    if max(map(abs, values[:2])) > TIME.value or max(map(abs, values[2:])) > DISTANCE.value:
        raise ValueError(f"a number is beyond {DISTANCE.value:g}, or a time beyond {TIME.text()}")
    if max(abs(value) for value in values[4:7]) > LARGEST_SPATIAL_PART:
        raise ValueError("z, roll or pitch is not 0, but only 2D poses can be compared")
    return values
