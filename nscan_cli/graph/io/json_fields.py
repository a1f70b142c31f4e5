"""The fields of the graph's JSON: rounding of numbers, and records that check each field that is read.

Poses have 9 decimals (nm, nrad), matrices 6 significant digits, and no zero has a sign, so that a graph that
is read and written again gives the same bytes. The exception is a matrix with an eigenvalue that rounding
made negative: reading sets it to 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from nscan_cli.files.limits import DISTANCE, INFORMATION, Limit
from nscan_cli.graph.io.symmetric_matrices import from_upper_triangle, upper_triangle
from nscan_cli.graph.relations.semidefinite import IndefiniteError, semidefinite
from nscan_cli.poses import Array, wrap

POSE_DECIMALS = 9
"""Decimals of poses in files, m and rad."""
LARGEST_ANGLE = 3.141592653
"""The largest angle below π with 9 decimals, rad."""
LARGEST_INTEGER = 2**53
"""Above it, not every JSON reader keeps integers exact."""


def pose_rows(poses: Array) -> list[list[float]]:
    """Poses (N, 3) as lists of rounded numbers; angles in (−π, π]."""
    angles = wrap(poses[:, 2]).tolist()
    return [
        [
            round(x, POSE_DECIMALS) + 0.0,
            round(y, POSE_DECIMALS) + 0.0,
            min(max(round(angle, POSE_DECIMALS) + 0.0, -LARGEST_ANGLE), LARGEST_ANGLE),
        ]
        for (x, y, _), angle in zip(poses.tolist(), angles, strict=True)
    ]


def rounded_upper_triangle(matrix: Array) -> list[float]:
    """The upper triangle of a symmetric matrix, row by row, with 6 significant digits."""
    return [six_digits(entry) for entry in upper_triangle(matrix).tolist()]


def six_digits(number: float) -> float:
    """The number with 6 significant digits."""
    return float(f"{number:.6g}") + 0.0


class MalformedError(Exception):
    """A document is malformed at a place in it."""

    def __init__(self, place: str, problem: str) -> None:
        super().__init__(f"{place}: {problem}")


class JsonRecord:
    """A JSON object at a known place. Every access checks the value and raises MalformedError."""

    def __init__(self, value: Any, place: str) -> None:
        if not isinstance(value, dict):
            raise MalformedError(place, "is not a JSON object")
        self.value: dict[str, Any] = value
        self.place = place

    def __contains__(self, key: str) -> bool:
        return key in self.value

    def get(self, key: str) -> Any:
        """The value of a required key."""
        if key not in self.value:
            raise MalformedError(self.place, f"{key!r} is missing")
        return self.value[key]

    def wrong(self, key: str, expected: str) -> MalformedError:
        """The error of a key whose value is not as expected."""
        return MalformedError(self.place, f"{key!r} is not {expected}")

    def text(self, key: str, choices: tuple[str, ...] = ()) -> str:
        """A string; one of `choices`, if given."""
        value = self.get(key)
        if choices and value not in choices:
            raise self.wrong(key, "one of " + ", ".join(choices))
        if not isinstance(value, str):
            raise self.wrong(key, "a string")
        return value

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self.get(key)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def integer(self, key: str) -> int:
        """An integer of at least 0."""
        value = self.get(key)
        if not _is_integer(value):
            raise self.wrong(key, "an integer of at least 0")
        return int(value)

    def integers(self, key: str) -> tuple[int, ...]:
        """A list of at least two distinct integers of at least 0."""
        values = self.get(key)
        if not isinstance(values, list) or not all(_is_integer(value) for value in values):
            raise self.wrong(key, "a list of integers of at least 0")
        if len(values) < 2 or len(set(values)) < len(values):
            raise self.wrong(key, "a list of at least two distinct integers")
        return tuple(values)

    def number(self, key: str) -> float:
        """A finite number."""
        error = self.wrong(key, "a finite number")
        return float(bounded_numbers([self.get(key)], 1, error)[0])

    def pose(self, key: str) -> Array:
        """(3,) x, y, φ."""
        return bounded_numbers(
            self.get(key), 3, self.wrong(key, f"a pose of three {_bounded(DISTANCE)}"), DISTANCE
        )

    def poses(self, key: str, count: int) -> Array:
        """(count, 3) poses."""
        values = self.get(key)
        error = self.wrong(key, f"a list of {count} poses of three {_bounded(DISTANCE)}")
        if not isinstance(values, list) or len(values) != count:
            raise error
        return np.array([bounded_numbers(value, 3, error, DISTANCE) for value in values])

    def information(self, key: str, size: int, fixed: int | None = None) -> Array:
        """The positive semi-definite matrix (size, size) of an upper triangle.

        Eigenvalues that rounding made negative become 0. The rows and columns of pose `fixed` are not
        checked.
        """
        count = size * (size + 1) // 2
        numbers = f"{count} {_bounded(INFORMATION)}"
        error = self.wrong(key, f"the upper triangle of a {size} × {size} matrix: {numbers}")
        matrix = from_upper_triangle(bounded_numbers(self.get(key), count, error, INFORMATION), size)
        block: Any = ...
        if fixed is not None:
            others = np.delete(np.arange(size), slice(3 * fixed, 3 * fixed + 3))
            block = np.ix_(others, others)
        try:
            (matrix[block],) = semidefinite(matrix[block][None])
        except IndefiniteError as error:
            raise MalformedError(self.place, f"{key!r} is not positive semi-definite: it {error}") from error
        return matrix

    def records(self, key: str) -> Iterator[JsonRecord]:
        """The objects of a list, each with its place in the document."""
        values = self.get(key)
        if not isinstance(values, list):
            raise self.wrong(key, "a list")
        for index, value in enumerate(values):
            yield JsonRecord(value, f"{key}[{index}]")


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= LARGEST_INTEGER


def _bounded(limit: Limit) -> str:
    return f"finite numbers up to {limit.value:g}"


def bounded_numbers(values: Any, count: int, error: MalformedError, limit: Limit | None = None) -> Array:
    """A list of `count` finite numbers as an array, none beyond the limit. Raises the error."""
    if not isinstance(values, list) or len(values) != count:
        raise error
    # A bool is an int in Python, but not a number in JSON.
    if not all(type(value) in (int, float) for value in values):
        raise error
    try:
        array = np.array(values, dtype=np.float64)
    except OverflowError:
        raise error from None
    if not np.isfinite(array).all() or (limit is not None and (np.abs(array) > limit.value).any()):
        raise error
    return array
