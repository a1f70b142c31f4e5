"""Where beams point when a log's last direction contradicts its step: what walls say is used, and told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from nscan_cli.logs.beam_angles import beam_directions, second_is_straighter
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs import lines
from tests.logs.noisy_room import BEAMS, FIRST, STEP, readings, recording
from tests.logs.recordings.messages import Scan

LAST = FIRST + STEP * (BEAMS - 1)


def used_step(log) -> float:
    assert (log.angle_increment == log.angle_increment[0]).all()
    return float(log.angle_increment[0])


@pytest.mark.parametrize("factor", [0.5, 0.8, 1.25, 2.0])
def test_a_wrong_step_is_told_by_the_walls(read, factor):
    log = read(recording(readings(), step=factor * STEP, last=LAST, range_max=20.0))
    assert used_step(log) == pytest.approx(STEP, rel=1e-6)
    (warning,) = log.report.warnings
    assert "the last direction (angle_max) is 178°" in warning
    assert f"(angle_increment) of {2 * factor:g}° 180 beams end at" in warning
    assert "walls are straight with 2° per beam, which is used" in warning
    assert warning.endswith(f"--angle-increment {2 * factor:g} chooses the other")


@pytest.mark.parametrize("factor", [0.5, 0.8, 1.25, 2.0])
def test_a_wrong_last_direction_is_told_by_the_walls(read, factor):
    log = read(recording(readings(), last=FIRST + factor * STEP * (BEAMS - 1), range_max=20.0))
    assert used_step(log) == pytest.approx(STEP, rel=1e-6)
    (warning,) = log.report.warnings
    assert "walls are straight with 2° per beam, which is used" in warning
    assert warning.endswith(f"--angle-increment {2 * factor:g} chooses the other")


@pytest.mark.parametrize("option", [{"angle_increment": STEP}, {"angle_increment": 3 * STEP}])
def test_nothing_is_told_to_who_says_the_step(read, option: dict[str, Any]):
    log = read(recording(readings(), step=STEP / 2, last=LAST, range_max=20.0), **option)
    assert used_step(log) == option["angle_increment"]
    assert log.report.warnings == ()


@pytest.mark.parametrize(
    "last",
    [
        LAST - STEP,
        LAST + STEP,
        LAST + 2 * STEP,
        LAST + 0.3 * STEP,
        LAST - 2 * math.pi,
        FIRST,
        math.nan,
        math.inf,
    ],
)
def test_what_drivers_usually_differ_by_is_nothing_to_tell(read, last):
    """Beams counted for steps, rounding, a turn left out, and a last direction that was never set."""
    log = read(recording(readings(), last=last, range_max=20.0))
    assert used_step(log) == pytest.approx(STEP, rel=1e-6)
    assert log.report.warnings == ()


def test_scans_that_tell_nothing_are_read_by_the_step(read):
    noise = np.random.default_rng(1).uniform(1, 9, (40, 180)).astype(np.float32)
    log = read(recording(noise, last=0.0, range_max=20.0))
    assert used_step(log) == pytest.approx(STEP, rel=1e-6)
    assert "the scans do not show which is right" in log.report.warnings[0]
    # But not where it leads round more than once.
    log = read(recording(noise, step=3 * STEP, last=LAST, range_max=20.0))
    assert used_step(log) == pytest.approx(STEP, rel=1e-6)
    assert "cover more than a turn" in log.report.warnings[0]


def test_some_scans_that_contradict_themselves(read):
    written = recording(readings(), range_max=20.0)
    for at in range(1, 25, 2):
        assert isinstance(written[at].content, Scan)
        written[at] = written[at].with_scan(step=STEP / 2, last=LAST)
    log = read(written)
    np.testing.assert_allclose(log.angle_increment, STEP, rtol=1e-6)
    assert log.report.warnings[0].startswith("in 12 of 40 scans the last direction (angle_max) is 178°")


@pytest.mark.parametrize("stale", [True, False])
def test_scans_of_different_lengths_with_one_and_the_same_step_or_last_direction(read, stale):
    """Fewer beams over the whole turn with a step that was not set anew, or a turn that is cut off."""
    whole, written = readings(), recording(readings(), range_max=20.0)
    counts = [160 - k if stale else 120 - k for k in range(40)]
    steps = [STEP * 179 / (count - 1) if stale else STEP for count in counts]
    for k, (count, step) in enumerate(zip(counts, steps, strict=True)):
        ranges = readings(beams=count, step=step)[k] if stale else whole[k, :count]
        written[2 * k + 1] = written[2 * k + 1].with_scan(ranges=ranges, last=LAST)
    log = read(written)
    np.testing.assert_allclose(log.angle_increment, steps, rtol=1e-6)
    assert "walls are straight with" in log.report.warnings[0]


def test_a_laser_that_hangs_upside_down():
    raw = RawScans(
        readings(),
        np.full(40, FIRST),
        np.full(40, STEP / 2),
        [""] * 40,
        (0.0, 80.0),
        angle_max=np.full(40, LAST),
    )
    warnings: list[str] = []
    first, step = beam_directions(raw.mirrored(), ReadingOptions(), warnings)
    np.testing.assert_allclose(first, -FIRST)
    np.testing.assert_allclose(step, -STEP)
    assert len(warnings) == 1


def test_the_field_of_view_of_a_carmen_record_is_looked_at_too(tmp_path):
    head = f"ROBOTLASER1 0 {FIRST} {LAST - FIRST} {STEP / 2} 81.9 0.01 0 180"
    scans = [
        f"{head} {' '.join(f'{r:.2f}' for r in scan)} 0 0 0 0 0 0 0 0 0 0 0 0 {k}.0 h 0"
        for k, scan in enumerate(readings().tolist())
    ]
    assert used_step(lines.read(tmp_path, *scans)) == pytest.approx(STEP)


def test_the_angles_of_a_player_record_are_looked_at_too(tmp_path):
    head = f"16777343 6665 laser 00 001 001 0001 {FIRST:.5f} {LAST:.5f} {STEP / 2:.8f} 20.0 0180"
    scans = [
        f"{k}.000 {head} {' '.join(f'{r:.3f} 0' for r in scan)}" for k, scan in enumerate(readings().tolist())
    ]
    assert used_step(lines.read(tmp_path, *scans)) == pytest.approx(STEP, rel=1e-5)


@pytest.mark.parametrize(("one", "other"), [(STEP, STEP), (0.0, 0.0), (1.0, 2.0)])
def test_steps_that_walls_cannot_tell_apart(one, other):
    assert second_is_straighter(readings(), [one] * 40, [other] * 40) is None
