"""Completion: what shells are told, and the lines of docs/reference.md in those that are installed."""

from __future__ import annotations

import os
import re
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest

from nscan_cli.cli.main import COMMANDS, cli
from tests.data import REPOSITORY
from tests.docs.blocks import blocks

PATIENCE = 30.0
"""s"""


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """That of a shell with an nscan-cli in its path, and a home of its own."""
    tool = tmp_path / "bin" / "nscan-cli"
    tool.parent.mkdir()
    tool.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m nscan_cli "$@"\n')
    tool.chmod(0o755)
    own = {"HOME": str(tmp_path), "ZDOTDIR": str(tmp_path), "TERM": "dumb"}
    return {**os.environ, **own, "PATH": f"{tool.parent}:{os.environ['PATH']}"}


@pytest.fixture
def robots(tmp_path: Path) -> Path:
    """A folder with two files and a folder in it."""
    place = tmp_path / "robots"
    place.mkdir()
    (place / "office.log.gz").touch()
    (place / "office.json").touch()
    (place / "nights").mkdir()
    return place


def told(page: str, shell: str) -> str:
    """The line that a page tells the users of a shell to take."""
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    (found,) = (line for line in lines if f"COMPLETE={shell}_source" in line)
    return found


def answer(shell: str, line: str, folder: Path) -> str:
    """What a shell is told when it asks how a line goes on."""
    words = line.split(" ")
    asked = {
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(words) - 1),
        "_NSCAN_CLI_COMPLETE": f"{shell}_complete",
    }
    if shell == "fish":
        asked["COMP_CWORD"] = words[-1]
    command = [sys.executable, "-m", "nscan_cli"]
    done = subprocess.run(
        command, env={**os.environ, **asked}, cwd=folder, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_are_told_commands_options_and_choices(shell, tmp_path):
    for line, offered, others in (
        ("nscan-cli s", "slam", "render"),
        ("nscan-cli slam --ma", "--map", "--from"),
        ("nscan-cli slam --relations n", "nscan", "pairwise"),
    ):
        said = answer(shell, line, tmp_path)
        assert offered in said
        assert others not in said


@pytest.mark.parametrize("name", COMMANDS)
def test_whatever_is_named_like_a_file_is_completed_as_one(name):
    found = cli.get_command(click.Context(cli), name)
    assert found is not None
    named = [
        parameter
        for parameter in found.params
        if re.search(r"\.\w|FILE|FOLDER|GRAPH|LOG|RESULT", parameter.make_metavar(click.Context(found)))
    ]
    assert named
    for parameter in named:
        assert [
            item.type for item in parameter.type.shell_complete(click.Context(found), parameter, "of")
        ] == ["file"], parameter.name


def test_shells_are_told_where_a_file_comes(tmp_path):
    for line in ("nscan-cli info off", "nscan-cli info on.mcap off",
                 "nscan-cli render on.json on.mcap off", "nscan-cli slam office.log -o off",
                 "nscan-cli evaluate off", "nscan-cli match office.log --plot off",
                 "nscan-cli slam --config off"):  # fmt: skip
        assert answer("bash", line, tmp_path) == "file,off\n", line


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes(environment, robots):
    script = (
        f"{told('docs/reference.md', 'bash')}\n"
        "COMP_WORDS=(nscan-cli sl); COMP_CWORD=1; _nscan_cli_completion nscan-cli sl nscan-cli\n"
        'echo "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(["bash", "-c", script], env=environment, cwd=robots, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("slam\n", "")


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish")
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("nscan-cli sl", ["slam"]),
        ("nscan-cli slam --ma", ["--map", "--max-range", "--max-scans"]),
        ("nscan-cli slam --relations n", ["nscan"]),
        ("nscan-cli slam --relations=n", ["--relations=nscan"]),
        ("nscan-cli slam --map=offi", ["--map=office.json", "--map=office.log.gz"]),
        ("nscan-cli nightly radish --output=ni", ["--output=nights/"]),
        ("nscan-cli info off", ["office.json", "office.log.gz"]),
        ("nscan-cli info ni", ["nights/"]),
        ("nscan-cli info office.log.gz off", ["office.json", "office.log.gz"]),
        ("nscan-cli slam office.log.gz -o office.j", ["office.json"]),
        ("nscan-cli nightly radish -o ni", ["nights/"]),
    ],
)
def test_fish_completes(line, offered, environment, robots):
    """Its command `complete -C` gives what its user is offered, with a description after a tab."""
    script = f"{told('docs/reference.md', 'fish')}\ncomplete -C '{line}'\n"
    done = subprocess.run(
        ["fish", "--no-config", "-c", script], env=environment, cwd=robots, capture_output=True, text=True
    )
    assert done.stderr == ""
    assert sorted(each.partition("\t")[0] for each in done.stdout.splitlines()) == offered


@pytest.mark.skipif(shutil.which("zsh") is None, reason="no zsh")
@pytest.mark.parametrize(
    ("keys", "completed"),
    [
        ("nscan-cli sl", "nscan-cli slam "),
        ("nscan-cli slam --map m --relations n", "--relations nscan "),
        ("nscan-cli slam --relations=n", "--relations=nscan "),
        ("nscan-cli slam --carmen=office.l", "--carmen=office.log.gz "),
        ("nscan-cli slam --dep", "--depfile "),
        ("nscan-cli info office.l", "info office.log.gz "),
        ("nscan-cli nightly radish -o ni", "-o nights/"),
    ],
)
def test_zsh_completes(keys, completed, environment, robots):
    """On a terminal, by the tabulator key: only there zsh completes."""
    setup = f"autoload -Uz compinit && compinit -u\n{told('docs/reference.md', 'zsh')}\nPS1='ready> '\n"
    Path(environment["ZDOTDIR"], ".zshrc").write_text(setup)
    ours, its = os.openpty()
    shell = subprocess.Popen(["zsh", "-i"], env=environment, cwd=robots, stdin=its, stdout=its, stderr=its)
    os.close(its)
    try:
        started = shown(ours, "ready> ")
        assert "not found" not in started, started
        os.write(ours, f"{keys}\t".encode())
        assert completed in shown(ours, completed)
    finally:
        shell.kill()
        shell.wait()
        os.close(ours)


def shown(terminal: int, awaited: str) -> str:
    """What a terminal shows, until the awaited is there or patience ends."""
    output, end = b"", time.monotonic() + PATIENCE
    while awaited.encode() not in output and time.monotonic() < end:
        if select.select([terminal], [], [], 0.2)[0]:
            output += os.read(terminal, 4096)
    return output.decode(errors="replace")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_names_that_are_no_utf8_are_completed(tmp_path, shell):
    (tmp_path / os.fsdecode(b"\xff.toml")).touch()
    word = b"--config=\xff"
    settings = {b"COMP_WORDS": b"nscan-cli info " + word, b"COMP_CWORD": word if shell == "fish" else b"2",
                b"_NSCAN_CLI_COMPLETE": f"{shell}_complete".encode()}  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "nscan_cli"],
        cwd=tmp_path,
        env={**os.environb, b"PYTHONPATH": os.fsencode(REPOSITORY), **settings},
        capture_output=True,
        check=True,
    )
    # bash looks for files itself.
    assert (b"\xff" if shell == "bash" else word + b".toml") in done.stdout
