"""docs/reference.md says what the commands say, and leaves nothing out."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import click
import pytest

from nscan_cli import errors
from nscan_cli.cli import main
from nscan_cli.cli.main import COMMANDS, cli, run
from nscan_cli.cli.manual import EXAMPLES, EXIT_CODES
from nscan_cli.cli.subcommand import Option, Subcommand
from nscan_cli.nightly.manifest import KEY_CHECKS, read_manifest
from tests.data import CORRIDOR_LOG, REPOSITORY
from tests.docs.blocks import blocks
from tests.man_pages import man_pages
from tests.reference import LIMITS, MAN, reference

PAGE = (REPOSITORY / "docs" / "reference.md").read_text()
PARENT = click.Context(cli, info_name="nscan-cli")
MARK_OF_CLICK = "_NSCAN_CLI_COMPLETE"


def command(name: str) -> Subcommand:
    found = cli.get_command(PARENT, name)
    assert isinstance(found, Subcommand)
    return found


def test_the_page_is_what_the_commands_say_now():
    assert reference() == PAGE, "run: python -m tests.reference docs/reference.md"
    assert {path.name: path.read_text() for path in MAN.iterdir()} == man_pages(), "run the same"


@pytest.mark.skipif(shutil.which("groff") is None, reason="no groff")
def test_the_man_pages_are_set_without_a_warning():
    for path in MAN.iterdir():
        told = subprocess.run(
            ["groff", "-man", "-ww", "-Kutf8", "-Tutf8", "-z", str(path)],
            capture_output=True,
            text=True,
            check=True,
        )
        assert told.stderr == "", path.name


@pytest.mark.parametrize("name", COMMANDS)
def test_every_argument_and_option_is_there_and_told(name):
    chapter = PAGE.partition(f"## nscan-cli {name}\n")[2].partition("\n## nscan-cli ")[0]
    everybodys = PAGE.partition("## Reading the log\n")[2].partition("## Exit codes\n")[0]
    for parameter in command(name).params:
        if isinstance(parameter, click.Argument):
            assert f"| `{parameter.make_metavar(PARENT)}` | " in chapter
            continue
        assert isinstance(parameter, Option)
        assert parameter.help, parameter.name
        for option in (*parameter.opts, *parameter.secondary_opts):
            assert re.search(rf"^\| `[^`]*{re.escape(option)}\b", chapter + everybodys, re.MULTILINE), option
        variable = parameter.variables(click.Context(command(name)))[-1]
        assert re.search(rf"`{variable}` \|$", chapter + everybodys, re.MULTILINE), variable


def test_no_two_options_of_a_command_share_a_variable_with_each_other_or_a_limit():
    limits = {limit.variable for limit in LIMITS}
    for name in COMMANDS:
        variables = [
            parameter.envvar for parameter in command(name).params if isinstance(parameter, click.Option)
        ]
        assert len(set(variables)) == len(variables)
        assert not limits & set(variables)


def test_every_exit_code_is_told():
    codes = {error.exit_code for error in errors.NscanError.__subclasses__()}
    codes |= {0, main.INTERNAL_ERROR, main.INTERRUPTED, main.CLOSED_EARLY}
    assert set(EXIT_CODES) == codes
    for code in codes:
        assert f"| {code} | {EXIT_CODES[code]} |" in PAGE


def test_the_manifest_that_is_shown_has_every_key_and_can_be_read(tmp_path):
    (block,) = (block for block in blocks("docs/reference.md", "toml") if "[[log]]" in block)
    (tmp_path / "robots.toml").write_text(block)
    (entry,) = read_manifest(str(tmp_path / "robots.toml"), None)
    assert entry.name == "intel"
    assert (entry.max_translation, entry.parameters.mapping) == (0.02, {"max-scans": 8})
    for key in KEY_CHECKS:
        assert key in PAGE.partition("## Manifest\n")[2].partition("\n## ")[0]


def test_the_settings_that_are_shown_are_taken(tmp_path, capsys):
    block = next(block for block in blocks("docs/reference.md", "toml") if "[[log]]" not in block)
    (tmp_path / "settings.toml").write_text(block)
    assert run(["slam", "some.log", "--config", str(tmp_path / "settings.toml"), "--dump-config"]) == 0
    out = capsys.readouterr().out
    for line in ("max-range = 30.0", "mount = [0.1, 0.0, 0.0]", "no-loops = true"):
        assert line in out.splitlines()


def test_every_environment_variable_that_the_package_reads_is_told():
    read = set()
    for path in (REPOSITORY / "nscan_cli").rglob("*.py"):
        read |= set(re.findall(r"environ(?:ment)?(?:\.\w+\(|\[)\"(\w+)\"", path.read_text()))
    assert {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"} <= read
    for variable in (*read, MARK_OF_CLICK, *(limit.variable for limit in LIMITS)):
        assert variable in PAGE, variable


@pytest.mark.parametrize("name", COMMANDS)
def test_the_examples_of_the_help_are_calls_that_the_command_takes(name):
    assert len(command(name).examples) >= 2
    for line, purpose in command(name).examples:
        first, *_others = line.split(" | ")
        tool, called, *arguments = shlex.split(first)
        assert (tool, called) == ("nscan-cli", name)
        command(name).make_context(name, arguments, parent=PARENT)
        assert purpose
        assert not purpose.endswith(".")


def test_the_examples_of_the_whole_are_calls_too():
    for line, _purpose in EXAMPLES:
        _tool, name, *arguments = shlex.split(line)
        command(name).make_context(name, arguments, parent=PARENT)


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_the_help_fits_80_columns_but_for_lines_to_copy(name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run([name, "--help"] if name else ["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "Examples:" in lines
    wide = [line for line in lines if len(line) > 80 and not line.startswith("  nscan-cli ")]
    assert wide == []


def test_the_help_has_sections_in_order(capsys):
    assert run(["slam", "--help"]) == 0
    titles = [line for line in capsys.readouterr().out.splitlines() if re.fullmatch(r"\w.*:", line)]
    assert titles == ["Arguments:", "Options:", "Reading the log:", "Advanced:", "For all commands:",
                      "Examples:"]  # fmt: skip


def test_every_key_of_a_match_is_told_and_no_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["match", CORRIDOR_LOG, "--reference", "100", "--scan", "104", "-o", "match.json", "-q"]) == 0
    assert run(["nscan", CORRIDOR_LOG, "--scans", "100-108:4", "-o", "nscan.json", "-q"]) == 0
    written = {name: set(json.loads(Path(f"{name}.json").read_text())) for name in ("match", "nscan")}
    chapter = PAGE.partition("## Results of match and nscan\n")[2].partition("\n## ")[0]
    told: dict[str, set[str]] = {"match": set(), "nscan": set()}
    for keys, of in re.findall(r"^\| (`.*?`) \| (\S+) \| ", chapter, re.MULTILINE):
        for name in told if of == "both" else [of.strip("`")]:
            told[name] |= set(re.findall(r"`(\w+)`", keys))
    assert told == written
