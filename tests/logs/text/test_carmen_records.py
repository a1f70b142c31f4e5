"""CARMEN records among others: what one of them has wrong does not touch those that are read with it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text import carmen_records
from tests.logs.lines import flaser, read

NEW = "ROBOTLASER1 0 {start} 3.0 0.5 20 0 0 {beams} {ranges} {remissions} {pose} 0 0 0 0 0 {stamp} h 0"


def robotlaser(stamp: int, beams: int, start: str = "-1.5", pose: str = "1", remissions: str = "0") -> str:
    ranges = " ".join(f"{stamp + k / 8}" for k in range(beams))
    poses = f"{pose} 2 0 {pose} 2 0"
    return NEW.format(start=start, beams=beams, ranges=ranges, remissions=remissions, pose=poses, stamp=stamp)


PROBLEMS = {
    "whole": {},
    "wrong number of values": {"remissions": "1"},
    "an angle is out of bounds": {"start": "721"},
    "a pose is out of bounds": {"pose": "nan"},
    "a value is not a number": {"start": "x"},
}


@given(st.lists(st.tuples(st.sampled_from(sorted(PROBLEMS)), st.integers(1, 3)), max_size=12))
def test_records_are_taken_or_skipped_each_by_itself(kinds):
    lines = [robotlaser(stamp, beams, **PROBLEMS[kind]) for stamp, (kind, beams) in enumerate(kinds, 1)]
    skips = Skips("log", strict=False)
    found = carmen_records.lines_by_tag("\n".join(lines).encode(), skips).get("ROBOTLASER1", [])
    scans = carmen_records.carmen_scans("ROBOTLASER1", found, skips)
    whole = [(stamp, beams) for stamp, (kind, beams) in enumerate(kinds, 1) if kind == "whole"]
    assert scans.stamps == [str(stamp) for stamp, _ in whole]
    assert scans.lines == [stamp for stamp, _ in whole]
    assert scans.beams.tolist() == [beams for _, beams in whole]
    for row, (stamp, beams) in enumerate(whole):
        assert scans.ranges[row, :beams].tolist() == [stamp + k / 8 for k in range(beams)]
        assert np.isnan(scans.ranges[row, beams:]).all()
    assert scans.head[:, :4].tolist() == [[0, -1.5, 3.0, 0.5]] * len(whole)
    assert scans.robot.tolist() == [[1, 2, 0]] * len(whole)
    wrong = [kind for kind, _ in kinds if kind != "whole"]
    numbers = {kind: [stamp for stamp, (each, _) in enumerate(kinds, 1) if each == kind] for kind in wrong}
    assert skips.reasons == {kind: (len(lines), lines[0]) for kind, lines in numbers.items()}


def test_the_first_record_out_of_bounds_is_named(tmp_path):
    far = (2e9, 0.0, 0.0)
    lines = [flaser(k, laser=far if k in (4, 6) else (0.0, 0.0, 0.0)) for k in range(1, 9)]
    assert read(tmp_path, *lines).report.skipped == {"a pose is out of bounds": (2, 4)}
    with pytest.raises(InputDataError, match="line 4: a pose is out of bounds"):
        read(tmp_path, *lines, options=ReadingOptions(strict=True))


MALFORMED = {
    "FLASER 3 1 2 0 0 0 0 0 0 1.0 h 0": "wrong number of values",
    "FLASER 999999999 1 2 0 0 0 0 0 0 1.0 h 0": "the beam count is not in 1…16384",
    "FLASER 0 0 0 0 0 0 0 1.0 h 0": "the beam count is not in 1…16384",
    "FLASER -1 0 0 0 0 0 0 1.0 h 0": "the beam count is not in 1…16384",
    "FLASER x 1 2 0 0 0 0 0 0 1.0 h 0": "the beam count is not a number",
    "FLASER 2 1 x 0 0 0 0 0 0 1.0 h 0": "a value is not a number",
    "FLASER 2 1 1.2.3 0 0 0 0 0 0 1.0 h 0": "a value is not a number",
    "FLASER 2 1 2 0 0 nan 0 0 0 1.0 h 0": "a pose is out of bounds",
    "FLASER 2 1 2 0 0 0 1e300 0 0 1.0 h 0": "a pose is out of bounds",
    "FLASER": "wrong number of values",
    "\x07\x08 1 2": "not a CARMEN record",
}


@pytest.mark.parametrize("line", MALFORMED)
def test_malformed_records_are_counted_or_refused(tmp_path, line):
    lines = (flaser(1), flaser(2, laser=(1, 0, 0)), line, flaser(3), line)
    log = read(tmp_path, *lines)
    assert len(log) == 3
    assert log.report.skipped == {MALFORMED[line]: (2, 3)}
    with pytest.raises(InputDataError, match=r"test\.log, line 3: .*--strict"):
        read(tmp_path, *lines, options=ReadingOptions(strict=True))


def test_a_wrong_count_of_remissions(tmp_path):
    good = "RAWLASER1 0 -1.5 3.0 0.5 20 0 0 2 1 2 1 9 11.0 h 0"
    log = read(tmp_path, good, good.replace("2 1 9", "2 2 9"))
    assert len(log) == 1
    assert log.report.skipped == {"wrong number of values": (1, 2)}
