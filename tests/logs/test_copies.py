"""Records that a log has twice are read once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.logs.copies import KEY, without_copies
from tests.logs import lines
from tests.logs.noisy_room import carmen, readings, recording

SAID = "that repeat earlier ones are left out"


def same(record: bytes) -> bytes:
    return record


def test_later_copies_are_left_out_but_not_of_a_robot_that_stands():
    records = [KEY * text for text in (b"1", b"2", b"2", b"2", b"3", b"1", b"2", b"4")]
    kept, said = without_copies(records, same)
    assert kept == [KEY * text for text in (b"1", b"2", b"2", b"2", b"3", b"4")]
    assert said == "2 records " + SAID
    assert without_copies(records[:5], same) == (records[:5], "")
    doubled = [KEY * text for text in (b"1", b"1", b"2", b"2", b"3", b"3")]
    assert without_copies(doubled, same) == (doubled[::2], "3 records " + SAID)
    damaged = [b"1", b"2", b"1"]
    assert without_copies(damaged, same) == (damaged, "")
    # Records that are alike at both ends may differ between these.
    alike = [b"-" * 100 + middle + b"-" * 100 for middle in (b"1", b"2", b"3")]
    assert without_copies(alike, same) == (alike, "")


def test_a_text_log_that_was_joined_to_itself(tmp_path):
    written = carmen(readings())
    once, twice = lines.read(tmp_path, *written), lines.read(tmp_path, *written, *written)
    np.testing.assert_array_equal(twice.ranges, once.ranges)
    np.testing.assert_array_equal(twice.times, once.times)
    assert once.report.warnings == ()
    assert twice.report.warnings == (f"{len(once)} records {SAID}",)


def test_a_text_log_whose_records_were_written_twice(tmp_path):
    written = carmen(readings())
    once = lines.read(tmp_path, *written)
    twice = lines.read(tmp_path, *(line for each in written for line in (each, each)))
    np.testing.assert_array_equal(twice.ranges, once.ranges)
    np.testing.assert_array_equal(twice.times, once.times)
    assert twice.report.warnings == (f"{len(once)} records {SAID}",)


def test_a_recording_that_was_played_twice(read):
    written = recording(readings())
    later = [replace(message, log_time=message.log_time + 10**11) for message in written]
    once, twice = read(written), read([*written, *later])
    np.testing.assert_array_equal(twice.ranges, once.ranges)
    np.testing.assert_array_equal(twice.times, once.times)
    np.testing.assert_allclose(twice.odometry, once.odometry, atol=1e-9)
    assert any(said.endswith(SAID) for said in twice.report.warnings)
