"""Numbers beyond reason are refused by limits with names, which can be set."""

from __future__ import annotations

import gzip
import io
import json
import re
from pathlib import Path

import pytest

from nscan_cli.cli.main import run
from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files import limits
from nscan_cli.files.inputs import read_bytes
from nscan_cli.files.limits import MB
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.cli.room_logs import room_log
from tests.data import REPOSITORY
from tests.graph.small_graph import small_graph
from tests.logs.forms import FORMS
from tests.logs.lines import flaser, read
from tests.logs.recordings.containers import repacked
from tests.logs.recordings.messages import drive
from tests.reference import LIMITS

DOCS = REPOSITORY / "docs" / "limits.md"
SALVAGE = ReadingOptions(salvage=True)


def set_limit(monkeypatch: pytest.MonkeyPatch, limit: limits.Limit, value: float) -> None:
    monkeypatch.setenv(limit.variable, str(value))


def test_the_docs_have_every_limit_with_its_default():
    rows = {
        cells[0].strip(" `"): cells[1].strip()
        for line in DOCS.read_text().splitlines()
        if line.startswith("| `NSCAN_CLI_MAX_") and (cells := line.strip("|").split("|"))
    }
    assert rows.keys() == {limit.variable for limit in LIMITS}
    for limit in LIMITS:
        number = rows[limit.variable].removesuffix(limit.unit).strip().replace(",", "")
        assert float(number) == limit.default


@pytest.mark.parametrize("value", ["much", "", "0", "-1", "nan", "inf"])
def test_a_limit_that_is_no_number_is_wrong_usage(monkeypatch, value):
    monkeypatch.setenv("NSCAN_CLI_MAX_BEAMS", value)
    with pytest.raises(WrongUsageError, match=r"NSCAN_CLI_MAX_BEAMS=.*: is not a number above 0"):
        _ = limits.BEAMS.value


def test_no_limit_is_an_option_of_a_command():
    """Their variables begin alike: NSCAN_CLI_MAX_SCANS is --max-scans."""
    import click

    from nscan_cli.cli.main import COMMANDS, cli

    options = set()
    for name in COMMANDS:
        command = cli.get_command(click.Context(cli), name)
        assert command is not None
        options |= {f"NSCAN_CLI_{param.name}".upper() for param in command.params}
    assert not options & {limit.variable for limit in LIMITS}


def test_a_file_beyond_the_limit_is_not_read(tmp_path, monkeypatch):
    set_limit(monkeypatch, limits.INPUT, 1)
    large = tmp_path / "large.log"
    with large.open("wb") as file:
        file.truncate(3 * MB)
    with pytest.raises(
        InputDataError, match=r"large\.log: has 3 MB, more than the limit of 1 MB.*NSCAN_CLI_MAX_INPUT"
    ):
        read_bytes(str(large))
    with pytest.raises(InputDataError, match="/dev/zero: goes on and on, more than the limit of 1 MB"):
        read_bytes("/dev/zero")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(bytes(2 * MB))))
    with pytest.raises(InputDataError, match="standard input: goes on and on"):
        read_bytes("-")
    set_limit(monkeypatch, limits.INPUT, 3)
    assert len(read_bytes(str(large))) == 3 * MB


@pytest.mark.parametrize("options", [ReadingOptions(), SALVAGE], ids=["whole", "salvage"])
def test_a_gzip_bomb_is_refused(tmp_path, monkeypatch, options):
    set_limit(monkeypatch, limits.INPUT, 2)
    path = tmp_path / "bomb.log.gz"
    path.write_bytes(gzip.compress(bytes(5 * MB)))
    with pytest.raises(
        InputDataError, match=r"bomb\.log\.gz: decompresses to too many bytes, more than the limit of 2 MB"
    ):
        read_log(str(path), options)


def test_many_gzip_members_are_read_in_one_go(tmp_path):
    """Each was once copied with all that follow it."""
    line = (flaser(1.0) + "\n").encode()
    members = [gzip.compress((flaser(1.0 + k) + "\n").encode()) for k in range(20_000)]
    path = tmp_path / "many.log.gz"
    path.write_bytes(b"".join(members))
    log = read_log(str(path), SALVAGE)
    assert len(log) == 20_000
    assert len(line) > 20


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_a_chunk_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch, compression):
    from mcap.writer import CompressionType

    data = repacked(FORMS["ros2"](drive(3, beams=16000), tmp_path), chunk_size=64 * 1024,
                    compression=CompressionType[compression.upper()])  # fmt: skip
    path = tmp_path / "wide.mcap"
    path.write_bytes(data)
    assert len(read_log(str(path))) == 3
    set_limit(monkeypatch, limits.INPUT, 0.1)
    monkeypatch.setattr("nscan_cli.logs.load.read_bytes", lambda path: data)
    with pytest.raises(
        InputDataError, match=r"chunk of \d+ MB, more than the limit of 0.1 MB|decompresses to too many"
    ):
        read_log(str(path), SALVAGE)


def test_the_messages_of_bags_count(tmp_path, monkeypatch):
    for form in ("ROS 1 bag", "ROS 2 db3"):
        data = FORMS[form](drive(3, beams=16000), tmp_path)
        path = tmp_path / "bag"
        path.write_bytes(data)
        assert len(read_log(str(path))) == 3
        set_limit(monkeypatch, limits.INPUT, 0.1)
        monkeypatch.setattr("nscan_cli.logs.load.read_bytes", lambda path, data=data: data)
        with pytest.raises(InputDataError, match="decompresses to too many bytes"):
            read_log(str(path), SALVAGE)
        monkeypatch.undo()


@pytest.mark.parametrize("count", ["1000000000", "16385", "9" * 5000])
def test_a_scan_of_too_many_beams_is_skipped(tmp_path, count):
    log = read(tmp_path, flaser(1.0), f"FLASER {count} 1 1 0 0 0 0 0 0 2.0 h 0.1", flaser(3.0))
    ((reason, (skipped, first)),) = log.report.skipped.items()
    assert (len(log), skipped, first) == (2, 1, 2)
    assert reason.startswith("the beam count is not")


def test_the_limit_of_beams_can_be_raised(tmp_path, monkeypatch):
    wide = flaser(1.0, (1.0,) * 20_000)
    with pytest.raises(InputDataError, match="no FLASER record can be read"):
        read(tmp_path, wide)
    set_limit(monkeypatch, limits.BEAMS, 20_000)
    assert read(tmp_path, wide).ranges.shape == (1, 20_000)


def test_one_wide_scan_among_many_narrow_ones_takes_no_memory(tmp_path, monkeypatch):
    lines = [flaser(1.0, (1.0,) * 1000), *(flaser(2.0 + k, (1.0,)) for k in range(50))]
    assert read(tmp_path, *lines).ranges.shape == (51, 1000)
    set_limit(monkeypatch, limits.READINGS, 50_000)
    with pytest.raises(InputDataError, match="51,000 readings, more than the limit of 50,000 readings"):
        read(tmp_path, *lines)


def test_no_more_kinds_of_records_than_the_limit(tmp_path, monkeypatch):
    set_limit(monkeypatch, limits.RECORD_KINDS, 3)
    log = read(tmp_path, flaser(1.0), *(f"TAG{k} 1" for k in range(9)))
    assert len(log.report.records) == 3
    assert log.report.skipped == {"not a CARMEN record": (7, 4)}


@pytest.mark.parametrize("reading", ["1e300", "1e999", "nan", "-1e300"])
def test_ranges_beyond_reason_say_nothing(tmp_path, reading):
    log = read(tmp_path, f"FLASER 3 1 {reading} 2 0 0 0 0 0 0 1.0 h 0.1")
    assert log.points(0).shape == (2, 2)


@pytest.mark.parametrize("value", ["nan", "inf", "1e300", "2e9"])
def test_poses_beyond_reason_are_skipped(tmp_path, value):
    log = read(tmp_path, flaser(1.0), f"FLASER 1 1 {value} 0 0 {value} 0 0 2.0 h 0.1")
    assert log.report.skipped == {"a pose is out of bounds": (1, 2)}


def test_stamps_a_century_back_are_times_and_beyond_reason_are_none(tmp_path):
    log = read(tmp_path, *(flaser(stamp) for stamp in ("1e9", "-2155760000", "1e12", "1_0", "2e9")))
    assert log.times[[0, -1]].tolist() == [-2155760000.0, 2e9]
    assert any("2 scans without a usable time stamp" in warning for warning in log.report.warnings)


def changed_graph(path: Path, **values: object) -> str:
    document = json.loads(write_graph(small_graph()))
    for place, value in values.items():
        holder = document
        *way, last = place.split("__")
        for key in way:
            holder = holder[int(key)] if key.isdigit() else holder[key]
        holder[int(last) if last.isdigit() else last] = value
    path.write_text(json.dumps(document))
    return str(path)


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("nodes__0__pose", [2e9, 0, 0], "three finite numbers up to 1e\\+09"),
        ("relations__0__measurement", [0, 1e300, 0], "three finite numbers up to 1e\\+09"),
        ("relations__1__poses__0", [0, 0, -2e9], "finite numbers up to 1e\\+09"),
        ("relations__0__information", [1e300, 0, 0, 1, 0, 1], "finite numbers up to 1e\\+30"),
        ("nodes__2__stamp", "1e12", "a time in seconds, as text, up to 1e\\+11 s"),
        ("nodes__2__scan", 2**53 + 1, "an integer of at least 0"),
        ("nodes__2__attached", 2**53, "'attached' is 9007199254740992, which is not a keyframe"),
    ],
)
def test_a_graph_with_numbers_beyond_reason(tmp_path, place, value, said):
    if place.endswith("attached"):
        path = changed_graph(tmp_path / "g.json", nodes__2__keyframe=False, nodes__2__attached=value)
    else:
        path = changed_graph(tmp_path / "g.json", **{place: value})
    with pytest.raises(InputDataError, match=said):
        load_graph(path)


def test_the_limit_of_distances_can_be_raised(tmp_path, monkeypatch):
    path = changed_graph(tmp_path / "g.json", nodes__0__pose=[2e9, 0, 0])
    set_limit(monkeypatch, limits.DISTANCE, 3e9)
    assert load_graph(path).poses[0, 0] == 2e9


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 100_000, '{"format": [' + "[" * 5000])
def test_json_nested_deeply_is_bad_data(tmp_path, text):
    path = tmp_path / "deep.json"
    path.write_text("{" + text if text[0] == "[" else text)
    with pytest.raises(InputDataError, match=r"deep\.json.*not JSON"):
        load_graph(str(path))


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "9" * 5000, "a = '\0'", "\xff"])
def test_toml_beyond_reason_is_bad_data(tmp_path, monkeypatch, capsys, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config.toml").write_text(text, encoding="latin-1")
    assert run(["info", "some.log", "--config", "config.toml"]) == 65
    assert re.fullmatch(r"nscan-cli: config\.toml: not TOML: .*\n", capsys.readouterr().err)


def test_a_map_of_a_million_cells_a_side_is_refused_at_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    # In a hundred days a robot comes far.
    line = flaser(9e6, (1.0,) * 30, (1e6, 1e6, 0.0))
    (tmp_path / "far.log").write_text(room_log(3) + line + "\n")
    arguments = ["slam", "far.log", "-q", "-o", "far.json", "--map", "far.png", "--carmen", "far.carmen"]
    assert run(arguments) == 2
    error = capsys.readouterr().err
    assert "more than 200,000,000; some poses are far off, or set NSCAN_CLI_MAX_MAP_CELLS higher" in error
    assert error.count("\n") == 1
    assert sorted(path.name for path in tmp_path.glob("far*")) == ["far.carmen", "far.json", "far.log"]
