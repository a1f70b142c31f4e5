"""The forms of the Radish collection, each as its writer wrote it, whole and disturbed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import flaser, read

EPOCH = 1037836800
WAY = np.array([(0.05 * k, 0.01 * k, 0.1 * k) for k in range(9)])
HALF = WAY[1] / 2


def ranges(k: int) -> np.ndarray:
    return np.round(2 + 0.01 * k + np.arange(181) / 100, 3)


def triples(k: int, unit: str = "rad", decimals: int = 6, first: int = -90, beams: int = 181) -> str:
    parts = []
    for beam, length in enumerate(ranges(k)[:beams]):
        bearing = first + beam if unit == "degrees" else math.radians(first + beam)
        parts.append(f"{length:.3f} {bearing:.{decimals}f} {beam % 7}")
    # The writers end their lines by a blank.
    return " ".join(parts) + " "


def of_2002(unit: str = "rad", decimals: int = 6, first: int = -90) -> list[str]:
    """`position i t px py pa …` and `laser i t (range bearing intensity)…`, a scan between two positions."""
    lines = ["# Run 02", "#", ""]
    for k, (x, y, theta) in enumerate(WAY):
        time = EPOCH + 0.2 * k
        lines.append(f"position 0 {time:.6f} {x:.3f} {y:.3f} {theta:.6f} 0.25 0.00 0.50 0 ")
        if k < len(WAY) - 1:
            lines.append(f"laser 0 {time + 0.1:.6f} {triples(k, unit, decimals, first)}")
    return lines


def with_heads_of_version_1(lines: list[str]) -> list[str]:
    """As in intel_oregon: server's time, host, port, interface, index, the data's time."""
    found = []
    for line in lines:
        if line[:1] in ("", "#"):
            found.append(line)
            continue
        interface, index, time, payload = line.split(" ", 3)
        head = f"{float(time) + 0.013:014.3f} oregon 6665 {interface} {int(index):02d}"
        found.append(f"{head} {float(time):014.3f} {payload}")
    return found


FORMS = {
    "2002": (of_2002(), "Player, form of 2002"),
    "intel_oregon": (with_heads_of_version_1(of_2002(decimals=4)), "Player, version 1"),
}


@pytest.mark.parametrize("form", FORMS)
def test_a_bearing_for_every_beam(tmp_path, form):
    lines, name = FORMS[form]
    log = read(tmp_path, *lines)
    assert (log.format, log.laser, len(log)) == (name, "laser:0", 8)
    assert log.report.skipped == {}
    np.testing.assert_allclose(log.angle_min, math.radians(-90), atol=1e-12)
    np.testing.assert_allclose(log.angle_increment, math.radians(1), atol=1e-12)
    np.testing.assert_array_equal(log.ranges, np.array([ranges(k) for k in range(8)], dtype=np.float32))
    # Each scan is half-way between two positions.
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry, WAY[:-1] + HALF, atol=1e-6)
    assert log.report.used["laser"] == "the only laser, bearings in rad"


@pytest.mark.parametrize("first", [-90, 0])
def test_bearings_in_degrees_are_told_by_their_size(tmp_path, first):
    log = read(tmp_path, *of_2002("degrees", 0, first))
    np.testing.assert_allclose(log.angle_min, math.radians(first), atol=1e-12)
    np.testing.assert_allclose(log.angle_increment, math.radians(1), atol=1e-12)
    assert log.report.used["laser"] == "the only laser, bearings in degrees"
    # Headings of a few rad stay so.
    assert log.odometry is not None
    assert log.odometry[-1, 2] == pytest.approx(0.75)
    assert any("begin at 0°" in warning for warning in log.report.warnings) == (first == 0)


def test_headings_in_degrees_are_told_by_the_way(tmp_path):
    corners = [(0, 0, 90), (0, 1, 90), (0, 2, 180), (-1, 2, 180), (-2, 2, 270), (-2, 1, 270)]
    lines = []
    for k, (x, y, degrees) in enumerate(corners):
        lines.append(f"position 0 {EPOCH + k}.0 {x:.3f} {y:.3f} {degrees}")
        lines.append(f"laser 0 {EPOCH + k}.0 {triples(k, 'degrees', 0)}")
    log = read(tmp_path, *lines)
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry[:, 2], np.radians([90, 90, 180, 180, -90, -90]))
    assert log.report.used["odometry"].endswith("headings in degrees")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("disturbance", ["line ends", "tabs", "comments", "no header"])
def test_what_does_not_matter(tmp_path, form, disturbance):
    lines = FORMS[form][0]
    text = "\n".join(lines)
    text = {
        "line ends": text.replace("\n", "\r\n"),
        "tabs": text.replace(" ", "\t"),
        "comments": text.replace("\n", "\n# a word, 1 2 3\n\n"),
        "no header": "\n".join(line for line in lines if line[:1] not in ("", "#")),
    }[disturbance]
    (tmp_path / "a.log").write_bytes(text.encode())
    log = read_log(str(tmp_path / "a.log"))
    assert len(log) == 8
    assert log.report.skipped == {}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("values", [1, 2, 3, 100, 300, 301, 302])
def test_a_line_that_is_cut_off_is_counted(tmp_path, form, values):
    lines = list(FORMS[form][0])
    number = next(k for k, line in enumerate(lines) if "laser" in line)
    head = lines[number].index(" 2.000 ")
    payload = lines[number][head:].split()
    lines[number] = f"{lines[number][:head]} {' '.join(payload[:values])}"
    log = read(tmp_path, *lines)
    assert len(log) == 7
    reason = "fewer beams than the other scans, from the same bearing on"
    assert log.report.skipped == {reason if values % 3 == 0 else "wrong number of values": (1, number + 1)}


def test_the_first_line_of_all_is_cut_off(tmp_path):
    lines = of_2002()[3:]
    log = read(tmp_path, "posit", *lines)
    assert len(log) == 8
    assert log.report.skipped == {"not a Player record": (1, 1)}


def test_headings_of_many_turns_stay_in_rad(tmp_path):
    lines = []
    for k in range(60):
        theta = 0.3 * k
        lines.append(
            f"position 0 {EPOCH + k}.0 {math.sin(theta):.4f} {-math.cos(theta):.4f} {theta + 0.15:.4f}"
        )
        lines.append(f"laser 0 {EPOCH + k}.0 {triples(k, 'degrees', 0)}")
    log = read(tmp_path, *lines)
    assert log.odometry is not None
    assert log.odometry[-1, 2] == pytest.approx(math.remainder(0.3 * 59 + 0.15, 2 * math.pi))


def test_beams_that_the_writer_left_out_say_nothing(tmp_path):
    lines = of_2002()
    whole = triples(0).split()
    gap = " ".join(whole[: 3 * 50] + whole[3 * 60 :])
    lines[4] = lines[4].replace(triples(0), f"{gap} ")
    log = read(tmp_path, *lines)
    expected = ranges(0).astype(np.float32)
    expected[50:60] = np.nan
    np.testing.assert_array_equal(log.ranges[0], expected)


def test_bearings_that_are_not_even_are_named(tmp_path):
    lines = of_2002()
    uneven = " ".join(f"2.0 {-1.5 + 0.01 * beam**2:.4f} 0" for beam in range(17))
    log = read(tmp_path, *lines, f"laser 0 {EPOCH + 1.05:.6f} {uneven}")
    assert log.report.skipped == {"the bearings are not evenly spaced": (1, len(lines) + 1)}
    with pytest.raises(InputDataError, match=r"line 1: no record of laser:0 .* not evenly spaced"):
        read(tmp_path, f"laser 0 {EPOCH}.5 {uneven}")
    with pytest.raises(InputDataError, match="a bearing is out of bounds"):
        read(tmp_path, f"laser 0 {EPOCH}.5 1.0 nan 0 2.0 0.1 0")


def test_gaps_make_no_table_without_bounds(tmp_path, monkeypatch):
    """A few readings can name a thousand directions: what counts is the table."""
    monkeypatch.setenv("NSCAN_CLI_MAX_READINGS", "10000")
    gap = "2.0 0.0000 0 2.0 0.0010 0 2.0 0.0020 0 2.0 1.5000 0"
    lines = [f"laser 0 {EPOCH + k}.5 {gap}" for k in range(20)]
    with pytest.raises(InputDataError, match="20 scans of up to 1,501 beams"):
        read(tmp_path, *lines)


def test_positions_with_more_or_fewer_values(tmp_path):
    lines = [line.replace(" 0.25 0.00 0.50 0 ", "") for line in of_2002()]
    lines[3] = lines[3][:-12]
    log = read(tmp_path, *lines)
    assert log.report.skipped == {"wrong number of values": (1, 4)}
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry[1], WAY[1] + HALF, atol=1e-6)


def test_a_log_of_2002_with_a_count_before_the_ranges(tmp_path):
    values = " ".join(f"{length:.3f} 0" for length in ranges(0))
    log = read(tmp_path, f"laser 0 {EPOCH}.0 -1.5708 +1.5708 +0.0175 0181 {values} ")
    np.testing.assert_array_equal(log.ranges[0], ranges(0).astype(np.float32))
    np.testing.assert_allclose(log.angle_increment, math.radians(1))


def test_runs_of_scans_between_positions(tmp_path):
    """As in stanford-gates1: the odometry is at the scans' times, whatever stands before them in the file."""
    head = "gates1 6665"
    beams = " ".join(["2.000  0"] * 181)

    def laser(time: float) -> str:
        return f"{time + 0.02:014.3f} {head} laser 00 {time:014.3f} -1.5708 +1.5708 +0.0175 0181 {beams} "

    def position(time: float, x: float) -> str:
        pose = f"{x:+07.3f} +00.000 +0.000 +00.000 +00.000 +00.000 0"
        return f"{time + 0.02:014.3f} {head} position 00 {time:014.3f} {pose}"

    lines = [
        "## Player version 1.4rc2 ", "## File version 0.1.0 ",
        laser(9.9), position(10.0, 0), f"{10.05:014.3f} {head} sync 00 {10.05:014.3f} ",
        laser(10.25), laser(10.5), laser(10.75), position(11.0, 1), laser(11.5), position(12.0, 3),
        laser(12.1),
    ]  # fmt: skip
    log = read(tmp_path, *lines)
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry[:, 0], [0, 0.25, 0.5, 0.75, 2, 3])
    assert not [each for each in log.report.warnings if "position:0" in each]


def nsh_level_a() -> list[str]:
    """CARMEN with a laser in front and one behind; parameters without a time of their own."""
    lines = [
        "# message_name [message contents] ipc_timestamp ipc_hostname logger_timestamp",
        "PARAM robot_frontlaser_offset 0.18 nohost 0",
        "PARAM robot_rearlaser_offset -0.25 nohost 0",
        "PARAM robot_use_laser on nohost 0",
        f"SYNC start {EPOCH}.000000 nsh 0.000000",
    ]
    for k in range(6):
        time = EPOCH + 0.2 * k
        robot = (0.1 * k, 0.0, 0.0)
        lines.append(f"ODOM {robot[0]} 0 0 0.5 0 0 {time:.6f} nsh {0.2 * k:.6f}")
        lines.append(flaser(time, tuple(ranges(k)[:180]), robot))
        lines.append(flaser(time + 0.05, tuple(ranges(k + 1)[:180]), robot, tag="RLASER"))
    return lines


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_laser_in_front_unless_another_is_chosen(tmp_path: Path, end: str):
    (tmp_path / "nsh.log").write_bytes(end.join(nsh_level_a()).encode())
    log = read_log(str(tmp_path / "nsh.log"))
    assert (log.laser, len(log), log.report.skipped) == ("FLASER", 6, {})
    np.testing.assert_allclose(log.mount, (0.18, 0, 0))
    assert "FLASER is used; --laser would choose RLASER (6)" in log.report.warnings
    assert log.report.records["SYNC"] == 1
    log = read_log(str(tmp_path / "nsh.log"), ReadingOptions(laser="RLASER"))
    assert (log.laser, len(log)) == ("RLASER", 6)
    np.testing.assert_allclose(log.mount[:2], (-0.25, 0))
    assert abs(log.mount[2]) == pytest.approx(math.pi)
    np.testing.assert_array_equal(log.ranges[0], ranges(1)[:180].astype(np.float32))


def test_a_carmen_line_that_is_cut_off_is_counted(tmp_path):
    lines = nsh_level_a()
    number = next(k for k, line in enumerate(lines) if line.startswith("FLASER"))
    lines[number] = lines[number][:300]
    log = read(tmp_path, *lines)
    assert len(log) == 5
    assert log.report.skipped == {"wrong number of values": (1, number + 1)}
