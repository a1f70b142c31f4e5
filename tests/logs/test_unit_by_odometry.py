"""The unit of the readings by odometry: one that the size of the readings does not tell."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import SAMPLE_LOGS, data_file
from tests.logs.excerpts import excerpt
from tests.simulation.faults import ranges_scaled
from tests.simulation.odometry_faults import scaled

UNITS = [("inches", 0.0254), ("feet", 0.3048), ("decimetres", 0.1), ("metres divided by 10", 10.0)]
REAL = ["fr079", "mit-csail", "fr-campus", "fr-clinic"]


@pytest.fixture(scope="module")
def office() -> LaserLog:
    return read_log(str(SAMPLE_LOGS / "office.log.gz"))


def in_file(log: LaserLog, folder: Path, unit: float) -> Path:
    """The log as a file whose readings are in a unit, m."""
    path = folder / "unit.log"
    path.write_bytes(with_own_angles(ranges_scaled(log, 1.0 / unit, slice(None))))
    return path


def contradictions(path: Path, reading: ReadingOptions = ReadingOptions()) -> list[str]:
    """What reading says of units."""
    return [
        said
        for said in read_log(str(path), reading).report.contradictions
        if "unit" in said or "ranges are" in said
    ]


@pytest.mark.parametrize(("name", "unit"), UNITS)
def test_a_unit_is_put_right_and_said(office: LaserLog, tmp_path: Path, name: str, unit: float):
    path = in_file(office, tmp_path, unit)
    found = read_log(str(path))
    (said,) = contradictions(path)
    assert f"the ranges are in {name}: then odometry explains how they change" in said
    assert found.range_scale == unit
    # The values of no return are distances in this file.
    both = np.isfinite(found.ranges) & np.isfinite(office.ranges)
    np.testing.assert_allclose(found.ranges[both], office.ranges[both], atol=0.01)


def test_the_file_may_be_believed(office: LaserLog, tmp_path: Path):
    path = in_file(office, tmp_path, 0.3048)
    assert contradictions(path, ReadingOptions(as_recorded=True)) == []
    assert contradictions(path, ReadingOptions(range_scale=0.3048)) == []


@pytest.mark.parametrize("factor", [0.1, 0.4, 2.5, 10.0])
def test_odometry_in_another_unit_changes_no_ranges(office: LaserLog, tmp_path: Path, factor: float):
    """Rooms of the size of the readings are likelier than robots of such speeds."""
    path = in_file(scaled(office, factor), tmp_path, 1.0)
    assert contradictions(path) == []


def test_odometry_in_another_unit_takes_no_room_for_a_hundred_metres_wide(tmp_path: Path):
    """Readings in millimetres, and odometry in centimetres, agree as if the readings were in decimetres."""
    log = excerpt(read_log(str(data_file("fr079.log.gz"))), slice(2800, 4000))
    path = in_file(scaled(log, 100.0), tmp_path, 0.001)
    with pytest.raises(InputDataError, match=r"give --range-scale 0\.001"):
        read_log(str(path))


def test_odometry_that_contradicts_all_units_tells_none(office: LaserLog, tmp_path: Path):
    assert office.odometry is not None
    shuffled = replace(office, odometry=np.random.default_rng(2).permutation(office.odometry))
    assert not any("odometry explains" in said for said in contradictions(in_file(shuffled, tmp_path, 0.01)))


@pytest.mark.parametrize(
    ("name", "unit", "scale"),
    # Outdoors readings divided by 10 are as large as those of a small room.
    [(name, *unit) for name in REAL for unit in UNITS if unit[1] < 1.0 or not name.startswith("fr-c")],
)
def test_units_of_real_logs(tmp_path: Path, name: str, unit: str, scale: float):
    log = read_log(str(data_file(f"{name}.log.gz")), ReadingOptions(end=600.0))
    assert log.range_scale == 1.0
    (said,) = contradictions(in_file(log, tmp_path, scale))
    assert f"the ranges are in {unit}: " in said


def test_the_option_for_odometry_that_is_too_short_by_a_foot_is_named(office, tmp_path):
    """Outdoors, where ranges are long, odometry that was converted twice looks like ranges in feet."""
    for unit, is_named in ((0.3048, True), (0.0254, False)):
        (said,) = (
            said
            for said in read_log(str(in_file(office, tmp_path, unit))).report.contradictions
            if "then odometry explains" in said
        )
        assert ("odometry is too short instead, and so the map, --range-scale 1" in said) == is_named
