"""What a file may not do: be run, or lead to other files."""

from __future__ import annotations

import ast
import io
import json
import sqlite3
from pathlib import Path

import pytest

from nscan_cli.cli.graph_log import find_log
from nscan_cli.cli.main import run
from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.logs.load import read_log
from tests.cli.room_logs import room_log
from tests.data import PACKAGE
from tests.graph.small_graph import small_graph
from tests.logs.forms import FORMS
from tests.logs.recordings.containers import repacked
from tests.logs.recordings.messages import drive
from tests.logs.recordings.ros import ros2
from tests.logs.recordings.ros_text import definition

CALLS = {"eval", "exec", "compile", "__import__", "system", "popen"}
MODULES = {"pickle", "marshal", "shelve", "dill", "yaml"}
SCAN = "sensor_msgs/msg/LaserScan"


def test_the_package_evaluates_nothing_and_calls_no_shell():
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                regular = isinstance(node.func, ast.Attribute) and getattr(node.func.value, "id", "") == "re"
                assert name not in CALLS or regular, f"{path}:{node.lineno} calls {name}"
                assert all(keyword.arg != "shell" for keyword in node.keywords), f"{path}:{node.lineno}"
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                named = [alias.name for alias in node.names] + [getattr(node, "module", "") or ""]
                assert not MODULES & set(named), f"{path}:{node.lineno} imports {named}"


@pytest.mark.parametrize(
    "name",
    [
        "../secret.log",
        "../../etc/passwd",
        "/etc/passwd",
        "..",
        ".",
        "",
        "/",
        "sub/../../secret.log",
        "a\0b",
        "\0",
    ],
)
def test_a_graph_leads_to_no_file_outside_of_its_folder(tmp_path, monkeypatch, name):
    (tmp_path / "secret.log").write_text(room_log(3))
    (tmp_path / "sub").mkdir()
    monkeypatch.chdir(tmp_path / "sub")
    graph = small_graph()
    graph.provenance["inputs"][0]["name"] = name
    Path("graph.json").write_bytes(write_graph(graph))
    with pytest.raises(InputMissingError, match="neither beside it nor in the current folder"):
        find_log("graph.json", graph)
    assert run(["render", "graph.json", "-o", "map.png"]) == 66
    assert [path.name for path in Path().iterdir()] == ["graph.json"]


@pytest.mark.parametrize("reading", [5, {"mount": [1]}, {"mount": "x"}, {"min_range": "0"}, {"laser": 7},
                                     {"flip": "no"}, {"max_range": True}, {"strict": None}, {"mask": [1]},
                                     {"mask": [[1, "x"]]}])  # fmt: skip
def test_reading_options_of_a_graph_are_checked(tmp_path, monkeypatch, capsys, reading):
    monkeypatch.chdir(tmp_path)
    Path("room.log").write_text(room_log(5))
    assert run(["slam", "room.log", "-q", "-o", "room.json"]) == 0
    document = json.loads(Path("room.json").read_text())
    document["provenance"]["parameters"]["reading"] = reading
    Path("room.json").write_text(json.dumps(document))
    code = run(["render", "room.json", "-q", "-o", "map.png"])
    error = capsys.readouterr().err
    if isinstance(reading, dict):
        assert code == 65
        assert f"room.json: provenance.parameters.reading: {next(iter(reading))} is" in error
        assert error.count("\n") == 1
    else:
        assert code == 0


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("slam",), 5),
        (("slam", "nscan"), []),
        (("slam", "nscan", "radius"), "5"),
        (("slam", "nscan", "radius"), -1),
        (("slam", "nscan", "gaussians", "cell"), 0),
        (("slam", "nscan", "max_scans"), 2.5),
        (("slam", "nscan", "widenings"), []),
        (("slam", "nscan", "widenings"), [0.1] * 1000),
        (("slam", "relations"), "none"),
        (("slam", "refinement", "max_passes"), 10**30),
    ],
)
def test_parameters_of_a_graph_are_checked(tmp_path, monkeypatch, capsys, place, value):
    monkeypatch.chdir(tmp_path)
    Path("room.log").write_text(room_log(5))
    assert run(["slam", "room.log", "-q", "-o", "room.json"]) == 0
    document = json.loads(Path("room.json").read_text())
    holder = document["provenance"]["parameters"]
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    Path("room.json").write_text(json.dumps(document))
    capsys.readouterr()
    assert run(["slam", "--from", "room.json", "-q", "-o", "again.json"]) == 65
    error = capsys.readouterr().err
    assert error.startswith(f"nscan-cli: room.json: provenance.parameters: {'.'.join(place)} is ")
    assert error.count("\n") == 1
    assert not Path("again.json").exists()


def with_definition(encoding: str, text: str) -> bytes:
    return repacked(ros2(drive()), schemas={SCAN: (encoding, text.encode())})


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("ros2msg", definition(SCAN).replace("float32 range_max", "float64 range_max")),
        ("ros2msg", definition(SCAN) + "string[1000000000] more\n"),
        ("ros2msg", definition(SCAN).replace("float32 scan_time", "Nothing[1000000000] nothing")
         + "\n" + "=" * 80 + "\nMSG: sensor_msgs/Nothing\n"),
        ("ros2msg", "# " + "x" * 200_000 + "\n" + definition(SCAN)),
        ("ros2idl", "module a { const long X = 1 << 99999999999; };"),
        ("ros2idl", "module a { const long X = 999999999 * 999999999; };"),
        ("ros2msg", "float32[" + "9" * 5000 + "] x"),
        ("ros2msg", "import os"),
    ],
    ids=["fields", "array", "messages of no size", "long", "shift", "product", "digits", "code"],
)  # fmt: skip
def test_no_code_is_made_of_a_definition(tmp_path, encoding, text):
    """Only compared: rosbags would write a program of it, as long as the definition asks for."""
    path = tmp_path / "scan.mcap"
    path.write_bytes(with_definition(encoding, text))
    with pytest.raises(InputDataError, match=f"the definition of {SCAN} on /scan cannot be read"):
        read_log(str(path))


def test_comments_and_constants_of_a_definition_do_not_matter(tmp_path):
    path = tmp_path / "scan.mcap"
    text = "# a comment\nuint8 LARGEST=7\n" + definition(SCAN)
    path.write_bytes(with_definition("ros2msg", text))
    assert len(read_log(str(path))) == 12


def test_a_database_whose_values_are_computed_is_refused(tmp_path):
    """A column made by a formula has values that are not in the file."""
    path = tmp_path / "bag.db3"
    path.write_bytes(FORMS["ROS 2 db3"](drive(), tmp_path))
    with sqlite3.connect(path) as bag:
        bag.execute("ALTER TABLE messages RENAME TO old")
        bag.execute("CREATE TABLE messages (id INTEGER, topic_id INTEGER, timestamp INTEGER, "
                    "data BLOB GENERATED ALWAYS AS (zeroblob(900000000)))")  # fmt: skip
        bag.execute("INSERT INTO messages SELECT id, topic_id, timestamp FROM old")
    bag.close()
    with pytest.raises(InputDataError, match="the database is damaged"):
        read_log(str(path))


def test_foxglove_json_nested_deeply_is_a_message_that_cannot_be_decoded(tmp_path):
    from mcap.reader import make_reader
    from mcap.writer import Writer

    out, first = io.BytesIO(), True
    writer = Writer(out)
    writer.start(profile="")
    channels: dict[int, int] = {}
    data = FORMS["json"](drive(), tmp_path)
    for schema, channel, message in make_reader(io.BytesIO(data)).iter_messages():
        assert schema is not None
        if channel.id not in channels:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
        deep = first and schema.name == "foxglove.LaserScan"
        first = first and not deep
        content = b'{"ranges":' + b"[" * 100_000 if deep else message.data
        writer.add_message(channels[channel.id], message.log_time, content, message.publish_time)
    writer.finish()  # type: ignore[no-untyped-call]
    path = tmp_path / "deep.mcap"
    path.write_bytes(out.getvalue())
    log = read_log(str(path))
    assert (len(log), log.report.skipped) == (11, {"/scan: cannot be decoded": (1, 1)})


def test_a_long_line_of_script_text_is_read_in_one_go(tmp_path):
    """A pattern once tried every way to divide it."""
    path = tmp_path / "log.script"
    lines = [
        "POS 1 0: 0 0 0",
        "A 1 1" + " " * 300_000 + "x",
        "A 1 " + "1" * 300_000,
        "LASER-RANGE 1 0 0 1 180.0: 1",
    ]
    path.write_text("\n".join(lines) + "\n")
    log = read_log(str(path))
    assert log.report.skipped == {"not a .script record": (2, 2)}
