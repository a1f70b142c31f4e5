from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.evaluation.load_trajectory import load_trajectory
from nscan_cli.evaluation.reference_relations import ReferenceRelations, read_relations, relation_errors
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import compose, relative
from tests.data import data_file


def read(tmp_path: Path, text: str) -> ReferenceRelations:
    path = tmp_path / "floor.relations"
    path.write_text(text)
    return read_relations(str(path))


def trajectory(times: list[float], poses: list[list[float]]) -> Trajectory:
    return Trajectory(np.array(times), np.array(poses), tuple(str(time) for time in times))


def test_the_errors_of_a_turned_step_are_these(tmp_path: Path):
    # From (1, 1, 90°) to (1, 3, 180°): 2 ahead and 90° to the left, in the frame of the first.
    result = trajectory([10, 11], [[1, 1, np.pi / 2], [1, 3, np.pi]])
    # The relation says 2.3 ahead, 0.4 left, 100°: off by (0.3, 0.4), so 0.5 m, and 10°.
    relations = read(tmp_path, f"10 11 2.3 0.4 0 0 0 {np.radians(100)}\n")
    errors = relation_errors(result, relations)
    np.testing.assert_allclose(errors.translation, [0.5])
    np.testing.assert_allclose(errors.rotation, [10])


def test_rotations_are_compared_across_the_half_turn(tmp_path: Path):
    result = trajectory([0, 1], [[0, 0, 0], [0, 0, np.radians(179)]])
    errors = relation_errors(result, read(tmp_path, f"0 1 0 0 0 0 0 {np.radians(-179)}\n"))
    np.testing.assert_allclose(errors.rotation, [2])


def test_relations_are_counted_by_how_near_their_stamps_are(tmp_path: Path):
    result = trajectory([1, 2, 3], [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    relations = read(
        tmp_path,
        "# t1 t2 x y z roll pitch yaw\n"
        "1 2 1 0 0 0 0 0\n"
        "\n"
        "1.09 2.91 2 0 0 0 0 0\n"  # within 0.1 s
        "3 1 -2 0 0 0 0 0\n"  # backwards
        "1 3.11 2 0 0 0 0 0\n",  # 0.11 s off
    )
    errors = relation_errors(result, relations)
    assert relations.lines.tolist() == [2, 4, 5, 6]
    assert (errors.used.tolist(), errors.exact, errors.too_far) == ([0, 1, 2], 2, 1)
    assert errors.rows.tolist() == [[0, 1], [0, 2], [2, 0]]
    np.testing.assert_allclose(errors.translation, 0, atol=1e-12)


def test_the_figures_of_known_errors(tmp_path: Path):
    # Errors of 1, 2, 3 and 10 m: mean 4, squares of deviations 9 + 4 + 1 + 36 = 50, over n − 1 = 3.
    result = trajectory([0, 1], [[0, 0, 0], [0, 0, 0]])
    errors = relation_errors(
        result, read(tmp_path, "".join(f"0 1 0 {error} 0 0 0 0\n" for error in (3, 1, 10, 2)))
    )
    spread = errors.translation_spread
    assert (spread.mean, spread.median, spread.max, spread.mean_square) == (4, 2.5, 10, 28.5)
    assert spread.sd == pytest.approx(np.sqrt(50 / 3))
    assert errors.worst(2).tolist() == [2, 0]
    assert errors.worst(9).tolist() == [2, 0, 3, 1]


@given(st.integers(0, 2**32 - 1))
def test_relations_made_from_a_trajectory_fit_it_in_any_frame(seed: int):
    rng = np.random.default_rng(seed)
    poses = rng.uniform([-50, -50, -3], [50, 50, 3], size=(8, 3))
    pairs = rng.integers(0, 8, size=(10, 2))
    relations = ReferenceRelations(
        "made",
        tuple((str(a), str(b)) for a, b in pairs.tolist()),
        pairs.astype(float),
        relative(poses[pairs[:, 1]], poses[pairs[:, 0]]),
        np.arange(10),
    )
    moved = compose(rng.uniform(-3, 3, size=3), poses)
    errors = relation_errors(
        Trajectory(np.arange(8.0), moved, tuple(str(row) for row in range(8))), relations
    )
    assert errors.translation.max() < 1e-12
    assert errors.rotation.max() < 1e-12


def test_no_common_stamp_says_the_spans_and_the_offset(tmp_path: Path):
    result = trajectory([1, 2], [[0, 0, 0], [1, 0, 0]])
    with pytest.raises(InputDataError) as error:
        relation_errors(result, read(tmp_path, "101.5 103 1 0 0 0 0 0\n"), "floor.json")
    assert str(error.value) == (
        "floor.json: no stamp of floor.relations lies within 0.1 s of it; the result spans 1.000 to 2.000 s "
        "(2 poses), the reference 101.500 to 103.000 s (2 stamps), +100.500 s off at the start; "
        "give the reference of this log, in the same clock"
    )


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("#\n1 2 3 4 5 6 7\n", "floor.relations, line 2: 7 columns instead of 8; relations are lines 't1 t2"),
        ("1 2 0 0 0 0 0 left\n", "line 1: could not convert string to float: 'left'"),
        ("1 2 0 0 0 0 0 nan\n", "line 1: a number is not finite"),
        ("1 2 0 0 0.5 0 0 0\n", "line 1: z, roll or pitch is not 0"),
        ("# nothing\n", "floor.relations: no relation in it"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, text: str, problem: str):
    with pytest.raises(InputDataError, match=problem):
        read(tmp_path, text)


@pytest.mark.parametrize("between", ["\t", ",", ", ", ";"])
def test_they_may_be_written_with_other_separators(tmp_path: Path, between: str):
    line = "10.5 11.5 1 0.25 0 0 0 0.5"
    found = read(tmp_path, "\ufeff" + line.replace(" ", between) + "\n")
    assert found.stamps == (("10.5", "11.5"),)
    np.testing.assert_array_equal(found.poses, read(tmp_path, line).poses)


def test_missing_relations_say_so(tmp_path: Path):
    with pytest.raises(InputMissingError, match="no such file"):
        read_relations(str(tmp_path / "floor.relations"))


@pytest.mark.logs
@pytest.mark.parametrize(
    ("log", "mean", "sd"),
    [
        ("intel", 7.370, 14.349),
        ("fr079", 6.504, 13.664),
        ("mit-csail", 1.682, 5.292),
        ("mit-killian", 50.3, 128.1),
    ],
)
def test_odometry_has_the_published_error(log: str, mean: float, sd: float):
    """Kümmerle et al. 2009, absolute translational error of odometry in m. Their sd divides by n."""
    relations = read_relations(str(data_file(f"{log}.relations")))
    errors = relation_errors(load_trajectory(str(data_file(f"{log}.log.gz"))), relations)
    assert errors.exact == len(relations)
    digits = 1 if log == "mit-killian" else 3
    assert errors.translation.mean() == pytest.approx(mean, abs=0.6 * 10**-digits)
    assert errors.translation.std() == pytest.approx(sd, abs=0.6 * 10**-digits)
