"""Logs whose poses are a mapper's result: refused unless that is allowed."""

from __future__ import annotations

import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import flaser, read

CORRECTED = {
    "NEFF": [flaser(1.5, laser=(1, 0, 0)), "NEFF 12.5"],
    "WEIGHT": [flaser(1.5, laser=(1, 0, 0)), "WEIGHT 0.5"],
    "pippo": [flaser(1.5, laser=(1, 0, 0)).replace("nohost", "pippo")],
    "six digits": [flaser("1.13486e+09", laser=(1, 0, 0)), flaser("1.13487e+09", laser=(2, 0, 0))],
}


@pytest.mark.parametrize("sign", CORRECTED)
def test_corrected_poses_are_refused_unless_allowed(tmp_path, sign):
    with pytest.raises(InputDataError, match=f"{sign}.*--allow-corrected"):
        read(tmp_path, *CORRECTED[sign])
    log = read(tmp_path, *CORRECTED[sign], options=ReadingOptions(allow_corrected=True))
    assert log.odometry is not None
    assert log.odometry[0, 0] == 1
    assert any("result" in warning for warning in log.report.warnings)


@pytest.mark.parametrize("times", [("0", "0.2", "0.4"), ("976052857.337530", "976052857.5"), ("1.000000",)])
def test_equal_poses_alone_are_no_sign_of_correction(tmp_path, times):
    assert len(read(tmp_path, *(flaser(time, laser=(1, 0, 0)) for time in times))) == len(times)


def test_six_digit_times_alone_are_no_sign_of_correction(tmp_path):
    assert len(read(tmp_path, flaser("1.13486e+09", laser=(1.1, 0, 0), robot=(1, 0, 0)))) == 1


def test_a_corrected_log_can_be_read_without_its_poses(tmp_path):
    log = read(tmp_path, *CORRECTED["NEFF"], options=ReadingOptions(odometry=False))
    assert log.odometry is None
    assert log.report.corrected == "it has NEFF records"
    assert log.report.warnings[0] == "the poses are a mapper's result, not odometry (it has NEFF records)"
