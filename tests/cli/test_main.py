from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys

import click
import pytest

from nscan_cli import __version__
from nscan_cli.cli import main as frame
from nscan_cli.cli.main import COMMANDS, run
from nscan_cli.graph.io.json_graph import SCHEMA

SHOW_MODULES = (
    "import sys; from nscan_cli.cli.main import run; codes = [run(a.split()) for a in sys.argv[1:]]; "
)


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch):
    """A subcommand `fail` that raises what it is given."""

    def make(error: BaseException) -> None:
        @click.command("fail")
        def command() -> None:
            raise error

        monkeypatch.setattr(frame.LazyGroup, "get_command", lambda *_: command)

    return make


def test_help_and_version_are_no_failures(capsys):
    assert run(["--help"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in COMMANDS)
    assert run(["--version"]) == 0
    assert __version__ in capsys.readouterr().out


def test_the_command_has_the_garbage_collection_look_through_new_objects_only():
    script = (
        "import atexit, gc, sys; from nscan_cli.cli import main as frame; sys.argv[1:] = ['--version']; "
        "told = lambda: print(gc.get_threshold()[0] == frame.GC_THRESHOLD, gc.get_freeze_count() > 0); "
        "atexit.register(told); frame.main()"
    )
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.splitlines() == [f"nscan-cli, version {__version__}", "True True"]


def test_every_command_is_there_under_its_name():
    for name in COMMANDS:
        assert importlib.import_module(f"nscan_cli.cli.{name.replace('-', '_')}").command.name == name


def test_help_and_version_import_nothing_heavy():
    calls = ["--help", "--version", *(f"{name} --help" for name in COMMANDS)]
    script = SHOW_MODULES + (
        "assert codes == [0] * len(codes), codes; "
        "heavy = {'numpy', 'scipy', 'numba', 'PIL', 'rich'} & set(sys.modules); assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", script, *calls], check=True, stdout=subprocess.DEVNULL)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["rendr"], "nscan-cli: No such command 'rendr'; see nscan-cli --help\n"),
        (["--nope"], "nscan-cli: No such option '--nope'; see nscan-cli --help\n"),
        (
            ["slam", "a.log", "--odo"],
            "nscan-cli: slam: No such option '--odo', but there is --odom-topic and --odometry-scale; "
            "see nscan-cli slam --help\n",
        ),
        (["-q", "info", "a.log"], "nscan-cli: -q stands after the command's name; see nscan-cli --help\n"),
        (["-v", "info", "a.log"], "nscan-cli: -v stands after the command's name; see nscan-cli --help\n"),
        (["render"], "nscan-cli: render: Missing argument 'GRAPH.json'; see nscan-cli render --help\n"),
        (
            ["render", "g.json", "-o", "m.png", "--style", "oil"],
            "nscan-cli: render: --style: 'oil' is not one of map_server, paper; "
            "see nscan-cli render --help\n",
        ),
    ],
)
def test_wrong_usage_is_one_line_and_code_2(arguments, message, capsys):
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert (out, err) == ("", message)


def test_no_arguments_print_the_help_and_are_wrong_usage(capsys):
    assert run([]) == 2
    assert "Commands:" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "output", "code"),
    [(b"{", "map.png", 65), (None, "map.png", 66), (b"{", "missing/map.png", 73)],
    ids=["bad input", "missing input", "no place for the output"],
)
def test_a_users_mistake_is_one_line_with_its_code(content, output, code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if content is not None:
        (tmp_path / "graph.json").write_bytes(content)
    assert run(["render", "graph.json", "-o", output]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("nscan-cli: ")
    assert err.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == (["graph.json"] if content else [])


@pytest.mark.parametrize("flags", [["-vv"], ["-v", "-v"]])
def test_vv_shows_where_an_error_arose(flags, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["render", "graph.json", "-o", "map.png", *flags]) == 66
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert err.splitlines()[-1].startswith("nscan-cli: graph.json")


def test_a_bug_is_code_1_and_shows_no_traceback_unasked(failing, capsys):
    failing(RuntimeError("odd\nthing"))
    assert run(["fail"]) == 1
    assert capsys.readouterr().err == (
        "nscan-cli: internal error, please report it: RuntimeError: odd thing; -vv shows the traceback\n"
    )


def _from_an_interrupt() -> RuntimeError:
    """What Python makes of an interrupt that comes while a class is made, as in imports."""

    class Interrupting:
        def __set_name__(self, owner: type, name: str) -> None:
            raise KeyboardInterrupt

    try:
        type("Made", (), {"attribute": Interrupting()})
    except RuntimeError as error:
        return error
    except KeyboardInterrupt as error:
        # From Python 3.12 on it comes through as it is.
        wrapped = RuntimeError("wrapped")
        wrapped.__cause__ = error
        return wrapped
    raise AssertionError("nothing was raised")


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (KeyboardInterrupt(), 130),
        (_from_an_interrupt(), 130),
        (BrokenPipeError(32, "Broken pipe"), 141),
        (OSError(28, "No space left on device"), 73),
        (OSError(28, "No space left on device", "somewhere"), 1),
    ],
)
def test_other_ends_have_their_codes(failing, error, code, capsys):
    failing(error)
    assert run(["fail"]) == code
    assert "Traceback" not in capsys.readouterr().err


def python_m(*arguments: str, **options) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "nscan_cli", *arguments]
    return subprocess.Popen(command, stderr=subprocess.PIPE, **options)


def test_an_interrupt_is_code_130():
    """The command waits for a graph on its standard input when the interrupt comes."""
    process = python_m(
        "render", "-", "room.log", "-o", "map.png", stdin=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert process.stdin is not None
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(2)
    process.send_signal(signal.SIGINT)
    _out, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert b"Traceback" not in err


@pytest.mark.parametrize("arguments", [["--help"], ["render", "g", "-o", "m.png", "--dump-config"]])
def test_a_standard_output_that_is_closed_early_is_code_141(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    process = python_m(*arguments, stdout=writer)
    os.close(writer)
    _out, err = process.communicate(timeout=20)
    assert (process.returncode, err) == (141, b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
def test_a_standard_output_without_room_is_code_73():
    with open("/dev/full", "wb") as full:
        process = python_m("--help", stdout=full)
        _out, err = process.communicate(timeout=20)
    assert process.returncode == 73
    assert err == b"nscan-cli: standard output: cannot be written: No space left on device\n"


def test_an_alias_is_its_command(capsys):
    for alias, name in frame.ALIASES.items():
        assert run([alias, "--help"]) == 0
        told = capsys.readouterr().out
        assert run([name, "--help"]) == 0
        assert told.replace(f"nscan-cli {alias} ", f"nscan-cli {name} ") == capsys.readouterr().out
        assert alias in COMMANDS[name]


def test_the_schema_is_the_one_that_graphs_name(tmp_path, capsys):
    assert run(["schema"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed)["$id"] == SCHEMA
    assert run(["schema", "-o", str(tmp_path / "schema.json")]) == 0
    assert (tmp_path / "schema.json").read_text() == printed
