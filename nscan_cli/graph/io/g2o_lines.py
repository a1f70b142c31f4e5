"""The lines of a 2D pose graph in the formats of g2o and TORO, by their tags.

    VERTEX_SE2 id x y θ
    EDGE_SE2 i j dx dy dθ I11 I12 I13 I22 I23 I33
    VERTEX_SE3:QUAT id x y z qx qy qz qw
    EDGE_SE3:QUAT i j dx dy dz qx qy qz qw I11 I12 … I66
    VERTEX2 id x y θ
    EDGE2 i j dx dy dθ I11 I12 I22 I33 I13 I23
    FIX id …

VERTEX2 and EDGE2 are TORO's. SE3 poses have to lie in the plane. The information of their edges is that of
(x, y, z, qx, qy, qz); as qz = sin(θ/2), the information on θ is a quarter of that on qz.
"""

from __future__ import annotations

import io
import math
import re
from array import array
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import InputDataError
from nscan_cli.files.encoding import BYTE_ORDER_MARK
from nscan_cli.files.limits import DISTANCE, INFORMATION, RECORD_KINDS, Limit
from nscan_cli.graph.io.pose_columns import UNIT_TOLERANCE
from nscan_cli.poses import Array

G2O_REMEDY = "mend or remove the line"
LARGEST_KEY = 2**64 - 1
"""Keys of vertices have 64 bits."""
GTSAM_SYMBOL = re.compile("([A-Za-z])([0-9]{1,17})")
"""A key as GTSAM shows it, such as x12: the letter is the highest of the key's eight bytes."""
PLANAR_TOLERANCE = 1e-6
"""Largest z (m), qx and qy of a planar pose: the rounding to six decimals."""


class _NotPlanarError(ValueError):
    """A pose does not lie in the plane."""


@dataclass
class G2oLines:
    """The content of a file: V vertices and E edges as columns, and the other lines by tag."""

    vertices: dict[int, int] = field(default_factory=dict)
    """Key of each vertex → number of its line."""
    poses: array[float] = field(default_factory=lambda: array("d"))
    """3 V: x, y, θ."""
    edge_lines: array[int] = field(default_factory=lambda: array("q"))
    """E line numbers."""
    ends: array[int] = field(default_factory=lambda: array("Q"))
    """2 E keys."""
    measurements: array[float] = field(default_factory=lambda: array("d"))
    """3 E: dx, dy, dθ."""
    information: array[float] = field(default_factory=lambda: array("d"))
    """6 E: the upper triangle, row by row, in the frame of the measurement."""
    fixed: dict[int, int] = field(default_factory=dict)
    """Key of each fixed vertex → number of the line that fixes it."""
    skipped: Counter[str] = field(default_factory=Counter)
    """Tag → number of lines with it, which are not read."""
    other_vertices: set[int] = field(default_factory=set)
    """Keys of vertices that are not poses."""


def read_lines(data: bytes, name: str) -> G2oLines:
    """All lines of a file; errors name the file `name` and the line. Raises InputDataError."""
    lines = G2oLines()
    for number, line in enumerate(io.BytesIO(data.removeprefix(BYTE_ORDER_MARK)), start=1):
        fields = line.decode("utf-8", errors="replace").split("#", 1)[0].split()
        if not fields:
            continue
        try:
            _read_line(lines, number, fields)
        except _NotPlanarError as error:
            remedy = "give a graph of the plane: poses in space are not read"
            raise InputDataError(name, str(error), remedy, line=number) from error
        except ValueError as error:
            raise InputDataError(name, str(error), G2O_REMEDY, line=number) from error
    for values, width, at, limit in (
        (lines.poses, 3, list(lines.vertices.values()), DISTANCE),
        (lines.measurements, 3, lines.edge_lines, DISTANCE),
        (lines.information, 6, lines.edge_lines, INFORMATION),
    ):
        _check_limits(rows(values, width), at, limit, name)
    fixed = [line for key, line in lines.fixed.items() if key not in lines.other_vertices]
    if len(fixed) > 1:
        problem = "a second vertex is fixed, but only one can be"
        raise InputDataError(name, problem, G2O_REMEDY, line=fixed[1])
    return lines


def rows(values: array[float], width: int) -> Array:
    """Numbers as rows (N, width)."""
    return np.asarray(values, dtype=np.float64).reshape(-1, width)


def keys(values: array[int]) -> NDArray[np.uint64]:
    """Keys (N,)."""
    return np.asarray(values, dtype=np.uint64)


def key_text(key: int) -> str:
    """A key as messages show it, with GTSAM's symbol where it is one."""
    letter, number = chr(key >> 56), key & (1 << 56) - 1
    return f"{key} ({letter}{number})" if letter.isascii() and letter.isalpha() else f"{key}"


def _read_line(lines: G2oLines, number: int, fields: list[str]) -> None:
    """Add one line to the others. Raises ValueError where it is malformed."""
    tag = fields[0]
    if tag in VERTEX_TAGS:
        values, pose = VERTEX_TAGS[tag]
        _check_length(fields, values)
        key = _key(fields[1])
        if key in lines.vertices:
            raise ValueError(f"vertex {key_text(key)} is there already")
        lines.poses.extend(pose([float(text) for text in fields[2:]]))
        lines.vertices[key] = number
    elif tag in EDGE_TAGS:
        values, pose, information = EDGE_TAGS[tag]
        triangle = 6 if values == 3 else 21
        _check_length(fields, 2 + values + triangle)
        i, j = _key(fields[1]), _key(fields[2])
        if i == j:
            raise ValueError(f"the edge joins vertex {key_text(i)} with itself")
        numbers = [float(text) for text in fields[3:]]
        lines.measurements.extend(pose(numbers[:values]))
        lines.information.extend(information(numbers[values:]))
        lines.ends.extend((i, j))
        lines.edge_lines.append(number)
    elif tag == "FIX":
        for text in fields[1:]:
            lines.fixed.setdefault(_key(text), number)
    else:
        known = tag in lines.skipped or len(lines.skipped) < RECORD_KINDS.value
        lines.skipped[tag if known else "others"] += 1
        key_there = _key_of(fields[1]) if tag.startswith("VERTEX") and len(fields) > 1 else None
        if key_there is not None:
            lines.other_vertices.add(key_there)


def _check_length(fields: list[str], values: int) -> None:
    if len(fields) != 1 + values:
        raise ValueError(f"{fields[0]} has {len(fields) - 1} values instead of {values}")


def _key(text: str) -> int:
    key = _key_of(text)
    if key is None:
        raise ValueError(f"{text!r} is not a vertex id")
    return key


def _key_of(text: str) -> int | None:
    """The key in a text, of at most 64 bits; None where the text is not a key."""
    symbol = GTSAM_SYMBOL.fullmatch(text)
    if symbol and int(symbol[2]) < 1 << 56:
        return (ord(symbol[1]) << 56) + int(symbol[2])
    if text.isascii() and text.isdigit() and len(text) < 21 and int(text) <= LARGEST_KEY:
        return int(text)
    return None


def _check_limits(values: Array, lines: Sequence[int], limit: Limit, name: str) -> None:
    """Check rows of values. Raises InputDataError for the first line with a number beyond the limit."""
    wrong = np.flatnonzero(~(np.abs(values) <= limit.value).all(axis=1))
    if len(wrong):
        first = int(wrong[0])
        finite = np.isfinite(values[first]).all()
        problem = f"a number is beyond {limit.value:g}" if finite else "a number is not finite"
        raise InputDataError(name, problem, G2O_REMEDY, line=lines[first])


def _in_the_plane(numbers: list[float]) -> list[float]:
    """x, y, θ of a pose x, y, z, qx, qy, qz, qw. Raises _NotPlanarError where it is not planar."""
    x, y, z, *quaternion = numbers
    if not all(map(math.isfinite, numbers)):
        raise ValueError("a number is not finite")
    length = math.hypot(*quaternion)
    if not abs(length - 1.0) < UNIT_TOLERANCE:
        raise ValueError(f"the quaternion has the length {length:.3g} instead of 1")
    qx, qy, qz, qw = quaternion
    if max(abs(z), abs(qx), abs(qy)) > PLANAR_TOLERANCE:
        raise _NotPlanarError(f"the pose is not planar: z {z:.3g} m, qx {qx:.3g}, qy {qy:.3g}")
    return [x, y, math.remainder(2.0 * math.atan2(qz, qw), 2.0 * math.pi)]


def _from_toro(numbers: list[float]) -> list[float]:
    """The upper triangle, row by row, from TORO's I11 I12 I22 I33 I13 I23."""
    return [numbers[k] for k in (0, 1, 4, 2, 5, 3)]


def _from_quaternion(numbers: list[float]) -> list[float]:
    """The upper triangle of (x, y, θ), from that of (x, y, z, qx, qy, qz).

    z, qx and qy are measured as 0 and are 0, so their information adds nothing.
    """
    if not all(map(math.isfinite, numbers)):
        raise ValueError("a number is not finite")
    xx, xy, xq, yy, yq, qq = (numbers[k] for k in (0, 1, 5, 6, 10, 20))
    return [xx, xy, xq / 2, yy, yq / 2, qq / 4]


Conversion = Callable[[list[float]], list[float]]
VERTEX_TAGS: dict[str, tuple[int, Conversion]] = {
    "VERTEX_SE2": (4, list),
    "VERTEX2": (4, list),
    "VERTEX_SE3:QUAT": (8, _in_the_plane),
}
"""Tag → the number of values, and the conversion of those after the key to x, y, θ."""
EDGE_TAGS: dict[str, tuple[int, Conversion, Conversion]] = {
    "EDGE_SE2": (3, list, list),
    "EDGE2": (3, list, _from_toro),
    "EDGE_SE3:QUAT": (7, _in_the_plane, _from_quaternion),
}
"""Tag → the length of the measurement, its conversion to x, y, θ, and that of the information to 6
numbers."""
