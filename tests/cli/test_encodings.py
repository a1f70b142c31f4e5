"""Files whose names are no UTF-8, and streams that lack characters: nothing of both stops a command."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from nscan_cli.cli.main import run
from tests.cli.room_logs import room_log

NAME = "\udcffθ"
"""As Python calls the file whose name is a byte that is no UTF-8, and a letter that is."""
SHOWN = "\\xffθ"
PLAIN = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
STREAMS = {
    "utf-8": ({"PYTHONIOENCODING": "utf-8"}, "-90° to 90°", SHOWN),
    "latin-1": ({"PYTHONIOENCODING": "latin-1"}, "-90° to 90°", "\\xfftheta"),
    "ascii": ({"PYTHONIOENCODING": "ascii"}, "-90 deg to 90 deg", "\\xfftheta"),
    "no locale": (PLAIN, "-90 deg to 90 deg", "\\xfftheta"),
}


@pytest.fixture(scope="module", autouse=True)
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The kernels that `info` needs, so that no later call says that it compiles them."""
    path = tmp_path_factory.mktemp("compiled") / "room.log"
    path.write_text(room_log(12))
    assert run(["info", str(path)]) == 0


@pytest.fixture
def log(folder: Path) -> str:
    """A log in the current folder, and its true poses."""
    path = Path(f"{NAME}.log")
    path.write_text(room_log(12))
    poses = [f"{100 + 0.2 * k:.6f} {0.1 * k:.9f} 0 0 0 0 0 1\n" for k in range(12)]
    Path(f"{NAME}.tum").write_text("".join(poses))
    return str(path)


def printed(arguments: list[str], settings: dict[str, str]) -> subprocess.CompletedProcess[bytes]:
    kept = {
        name: value for name, value in os.environ.items() if not name.startswith(("LC_", "LANG", "PYTHON"))
    }
    return subprocess.run(
        [sys.executable, "-m", "nscan_cli", *map(os.fsencode, arguments)],
        env={**kept, "PYTHONPATH": os.environ.get("PYTHONPATH", ""), "LANG": "C.UTF-8", **settings},
        capture_output=True,
        check=False,
    )


@pytest.mark.parametrize("stream", STREAMS)
def test_what_is_printed_fits_any_encoding(log, stream):
    settings, view, name = STREAMS[stream]
    encoding = "ascii" if stream == "no locale" else stream
    done = printed(["info", log], settings)
    assert (done.returncode, done.stderr) == (0, b"")
    text = done.stdout.decode(encoding)
    assert f"field of view  {view}, " in text
    assert text.split()[1] == f"{name}.log,"
    missing = printed(["info", f"no {log}"], settings)
    assert missing.returncode == 66
    # What standard error lacks is escaped by Python itself before the first line of ours.
    assert missing.stderr.decode(encoding).startswith(f"nscan-cli: no {name}.log: no such file")


@pytest.mark.parametrize("stream", STREAMS)
def test_json_is_utf8_whatever_the_streams_are(log, stream):
    for arguments in (["info", "--json", log], ["evaluate", "--json", f"{NAME}.tum", "--reference", log]):
        done = printed(arguments, STREAMS[stream][0])
        if arguments[0] == "info":
            assert json.loads(done.stdout.decode())["file"] == f"{SHOWN}.log"
        else:
            assert done.returncode == 65
            assert b"internal" not in done.stderr
    config = printed(["info", log, "--topic", "/θ", "--dump-config"], STREAMS[stream][0])
    assert 'topic = "/θ"' in config.stdout.decode()


def test_every_command_takes_and_writes_such_names(log, capsys):
    graph, tum = f"{NAME}.json", f"{NAME}.tum"
    outputs = ["--map", f"{NAME}.png", "--trajectory", f"{NAME}.t.tum", "--g2o", f"{NAME}.g2o",
               "--carmen", f"{NAME}.c.log", "--depfile", f"{NAME}.d"]  # fmt: skip
    assert run(["match", log, "--reference", "0", "--scan", "3", "-o", f"{NAME}.m", "--plot", "m.png"]) == 0
    assert run(["nscan", log, "--scans", "0-8:4", "--initial", tum, "-o", f"{NAME}.n"]) == 0
    assert run(["slam", log, "-o", graph, *outputs]) == 0
    said = capsys.readouterr().err
    assert f"warning: {SHOWN}.yaml names the map {SHOWN}.png, which no loader will find" in said
    for name, inputs in ((graph, [log]), (f"{NAME}.m", [log]), (f"{NAME}.n", [log, tum])):
        named = [entry["name"] for entry in json.loads(Path(name).read_bytes())["provenance"]["inputs"]]
        assert named == [entry.replace(NAME, SHOWN) for entry in inputs]
    rule = Path(f"{NAME}.d").read_bytes()
    assert rule.startswith(b"\xff\xce\xb8.json \xff\xce\xb8.png \xff\xce\xb8.yaml ")
    assert rule.endswith(b": \xff\xce\xb8.log\n")
    assert Path(f"{NAME}.yaml").read_text("utf-8").startswith('image: "\\\\xffθ.png"\n')
    # The log is found through the graph.
    assert run(["render", graph, "-o", f"{NAME}.r.png", "--mcap", f"{NAME}.mcap"]) == 0
    assert run(["slam", "--from", graph, "-o", f"{NAME}.2.json", "--map", f"{NAME}.2.png"]) == 0
    assert run(["info", f"{NAME}.mcap"]) == 0
    assert run(["evaluate", graph, "--reference", tum, "--plot", f"{NAME}.e.png"]) == 0
    assert run(["slam", log, "-o", graph, "--dump-config"]) == 2
    assert (
        f"--dump-config: {SHOWN}.json is not UTF-8, which TOML needs; choose another"
        in capsys.readouterr().err
    )


def test_a_log_with_a_backslash_in_its_name_is_found_too(folder):
    Path("a\\b.log").write_text(room_log(12))
    assert run(["slam", "a\\b.log", "-o", "graph.json"]) == 0
    assert run(["render", "graph.json", "-o", "map.png"]) == 0


def test_nightly_in_such_a_folder(log, capsys):
    """A reason that names a file there stands in all that is written."""
    place = Path(NAME)
    place.mkdir()
    (place / "one.log").write_text(room_log(12))
    (place / "two.log").write_text(room_log(12))
    (place / "two.tum").mkdir()
    tables = '[[log]]\nname = "one"\n[[log]]\nname = "two"\nreference = "two.tum"\n'
    tables += '[[log]]\nname = "none"\noptional = true\n'
    (place / f"{NAME}.toml").write_text(tables)
    assert run(["nightly", str(place / f"{NAME}.toml"), "-o", f"{NAME}.nights", "--jobs", "1"]) == 3
    nights = Path(f"{NAME}.nights")
    logs = json.loads((nights / "report.json").read_bytes())["logs"]
    assert [each["status"] for each in logs] == ["good", "failed", "absent"]
    assert f"{SHOWN}/two.tum" in logs[1]["reasons"][0]
    assert f"{SHOWN}/two.tum" in (nights / "report.html").read_text("utf-8")
    assert f"{SHOWN}.toml" in (nights / "report.html").read_text("utf-8")


def test_a_config_file_names_files_as_one_would_type_them(log):
    """Where the system has no encoding, Python calls them by other text."""
    Path("θ.log").write_text(room_log(12))
    Path("options.toml").write_text('[slam]\noutput = "θ.json"\n', "utf-8")
    done = printed(["slam", "θ.log", "--config", "options.toml", "-q"], PLAIN)
    assert (done.returncode, done.stderr) == (0, b"")
    assert json.loads(Path("θ.json").read_bytes())["provenance"]["inputs"][0]["name"] == "θ.log"
