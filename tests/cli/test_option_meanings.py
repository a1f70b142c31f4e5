"""One option, one meaning: what sets an option of several commands, and what is said of a wrong value."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import click
import pytest

from nscan_cli.cli.main import COMMANDS, cli, run
from nscan_cli.cli.subcommand import COMMAND_SPECIFIC, Option

EVERY = [
    (name, parameter)
    for name in COMMANDS
    if (command := cli.get_command(click.Context(cli), name)) is not None
    for parameter in command.params
    if isinstance(parameter, Option)
]
ARGUMENTS = {
    "match": ["a.log", "--reference", "0", "--scan", "1"],
    "nscan": ["a.log", "--scans", "1,2"],
    "render": ["a.json", "-o", "a.png"],
    "evaluate": ["a.json"],
    "nightly": ["a.toml", "-o", "nights"],
}
LOG: dict[str, list[str]] = {"schema": [], "warm-up": []}
"""The commands that take no LOG nor anything else."""
JARGON = re.compile(r"valid|range|Sentinel|[<>]=|\bx[<>]|type|Traceback|internal", re.IGNORECASE)


@pytest.fixture(autouse=True)
def _nothing_set(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    for name in list(os.environ):
        if name.startswith("NSCAN_CLI_"):
            monkeypatch.delenv(name)


def meaning(option: Option) -> tuple[Any, ...]:
    """What has to be the same where an option of one name is to mean the same."""
    kind = {key: value for key, value in vars(option.type).items() if not callable(value)}
    return type(option.type), str(kind), option.is_flag, option.metavar, option.help, str(option.default)


def test_options_of_one_name_mean_the_same_or_are_a_commands_own():
    meanings: dict[str, set[tuple[Any, ...]]] = {}
    for _name, option in EVERY:
        meanings.setdefault(option.long_name, set()).add(meaning(option))
    assert {name for name, found in meanings.items() if len(found) > 1} == COMMAND_SPECIFIC


def test_no_two_options_have_the_same_variable():
    """Neither do NSCAN_CLI_OPTION of one and NSCAN_CLI_COMMAND_OPTION of another."""
    found: dict[str, str] = {}
    for name, option in EVERY:
        context = click.Context(click.Command(name))
        own, *shared = option.variables(context)
        assert found.setdefault(own, f"{name} {option.long_name}") == f"{name} {option.long_name}"
        for variable in shared:
            assert found.setdefault(variable, option.long_name) == option.long_name


@pytest.mark.parametrize(("name", "key", "value"), [("slam", "relations", "pairwise"),
                                                    ("evaluate", "relations", "a.relations"),
                                                    ("match", "reference", "7"),
                                                    ("evaluate", "reference", "a.tum"),
                                                    ("render", "trajectory", "1")])  # fmt: skip
def test_such_an_option_is_set_by_its_commands_variable_and_table_alone(
    name, key, value, monkeypatch, capsys
):
    arguments = [name, *ARGUMENTS.get(name, LOG.get(name, ["a.log"])), "--dump-config"]
    if name == "match":
        arguments = [name, "a.log", "--scan", "1", "--dump-config"]
    shared, own = f"NSCAN_CLI_{key.upper()}", f"NSCAN_CLI_{name.upper()}_{key.upper()}"
    monkeypatch.setenv(shared, value)
    assert run(arguments) == 2
    assert capsys.readouterr().err == (
        f"nscan-cli: {shared} in the environment: --{key} has another meaning in each command; "
        f"set {own} instead\n"
    )
    monkeypatch.setenv(own, value)
    assert run(arguments) == 0
    dumped = capsys.readouterr().out
    assert re.search(rf'^{key} = "?{"true" if value == "1" else value}"?$', dumped, re.MULTILINE)
    monkeypatch.delenv(own)
    monkeypatch.delenv(shared)
    Path("all.toml").write_text(dumped)
    assert run([*arguments, "--config", "all.toml"]) == 0
    assert capsys.readouterr().out == dumped
    assert run([*arguments[:-1], f"--{key}", *([] if value == "1" else [value]), "--dump-config"]) == 0


def test_a_shared_name_counts_for_nothing_where_the_option_is_given_or_is_not(monkeypatch, capsys):
    monkeypatch.setenv("NSCAN_CLI_RELATIONS", "pairwise")
    assert run(["slam", "a.log", "--relations", "nscan", "--dump-config"]) == 0
    assert 'relations = "nscan"' in capsys.readouterr().out
    assert run(["info", "a.log", "--dump-config"]) == 0


def test_one_file_has_settings_for_all_commands(capsys):
    Path("all.toml").write_text(
        'every = 2\nresolution = 0.1\nmax-scans = 7\njobs = 2\n[slam]\nrelations = "pairwise"\n'
        '[evaluate]\nrelations = "a.relations"\n[match]\nreference = 3\nscan = 4\n[nscan]\nscans = "1,2"\n'
        '[nightly]\noutput = "nights"\n[render]\noutput = "map.png"\n'
    )
    found = {}
    for name in COMMANDS:
        assert run([name, *LOG.get(name, ["a.log"]), "--config", "all.toml", "--dump-config"]) == 0
        found[name] = capsys.readouterr().out
    assert [name for name in COMMANDS if "every = 2" in found[name]] == [
        name for name in COMMANDS if name not in ("nightly", *LOG)
    ]
    assert "resolution = 0.1" in found["render"]
    assert "max-scans = 7" in found["slam"]
    assert 'relations = "pairwise"' in found["slam"]
    assert 'relations = "a.relations"' in found["evaluate"]
    assert "reference = 3" in found["match"]
    assert "reference" not in found["evaluate"]
    Path("all.toml").write_text("evry = 2\n")
    for name in COMMANDS:
        assert run([name, *ARGUMENTS.get(name, LOG.get(name, ["a.log"])), "--config", "all.toml"]) == 65
        assert f"all.toml: {name} has no option 'evry'; known: " in capsys.readouterr().err


def test_a_key_at_the_top_that_means_several_things_is_refused_with_the_tables(capsys):
    Path("all.toml").write_text('relations = "pairwise"\n')
    assert run(["slam", "a.log", "--config", "all.toml"]) == 65
    assert capsys.readouterr().err == (
        "nscan-cli: all.toml: relations is set for all commands, and has another meaning in each; "
        "set it below [slam] or [evaluate]\n"
    )


def wrong_values(option: Option) -> list[str]:
    """Values that the type of an option does not take; none where it takes any text."""
    kind: Any = option.type
    if isinstance(kind, (click.types.FloatParamType, click.types.IntParamType)):
        whole = isinstance(kind, click.types.IntParamType)
        low, high = getattr(kind, "min", None), getattr(kind, "max", None)
        beyond = ([] if low is None else [f"{low - 1:g}"]) + ([] if high is None else [f"{high + 1:g}"])
        return ["nothing", "None", "nan", "inf", *(["1.5"] if whole else []), *beyond]
    text = isinstance(kind, (click.Path, click.types.StringParamType))
    return [] if text else ["nothing", "-3,nan,?"]


VALUED = [
    pytest.param(name, option, value, id=f"{name} {option.long_name} {value}")
    for name, option in EVERY
    if not option.is_flag and not option.count
    for value in wrong_values(option)
]


def assert_plain(err: str, place: str) -> None:
    assert err.startswith(f"nscan-cli: {place}")
    assert err.count("\n") == 1
    assert not JARGON.search(err.removeprefix(f"nscan-cli: {place}")), err


@pytest.mark.parametrize(("name", "option", "value"), VALUED)
def test_a_wrong_value_of_any_option_is_told_in_a_plain_line(name, option, value, monkeypatch, capsys):
    arguments = [name, *ARGUMENTS.get(name, LOG.get(name, ["a.log"]))]
    assert run([*arguments, f"--{option.long_name}", value]) == 2
    assert_plain(capsys.readouterr().err, f"{name}: --{option.long_name}: ")
    Path("all.toml").write_text(f"[{name}]\n{option.long_name} = {value!r}\n")
    assert run([*arguments, "--config", "all.toml"]) == 65
    assert_plain(capsys.readouterr().err, f"all.toml: {option.long_name}: ")
    variable = option.variables(click.Context(click.Command(name)))[0]
    monkeypatch.setenv(variable, value)
    given = f"--{option.long_name}"
    if given in arguments:
        del arguments[arguments.index(given) : arguments.index(given) + 2]
    assert run(arguments) == 2
    assert_plain(capsys.readouterr().err, f"{name}: {variable} in the environment: ")


@pytest.mark.parametrize(("name", "option"), [each for each in EVERY if each[1].is_flag])
def test_so_is_a_flag_that_is_set_to_neither_true_nor_false(name, option, monkeypatch, capsys):
    variable = option.variables(click.Context(click.Command(name)))[0]
    monkeypatch.setenv(variable, "perhaps")
    assert run([name, *ARGUMENTS.get(name, LOG.get(name, ["a.log"]))]) == 2
    err = capsys.readouterr().err
    assert f"{name}: {variable} in the environment: 'perhaps' is neither true nor false; see" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["render", "g.json", "-o", "m.png", "--resolution", "11"],
         "--resolution: must be from 0.001 to 10 (m), but is 11"),
        (["info", "a.log", "--max-range", "0"], "--max-range: must be above 0 (m), but is 0"),
        (["info", "a.log", "--every", "0"], "--every: must be 1 or more, but is 0"),
        (["info", "a.log", "--start", "soon"], "--start: 'soon' is not a number"),
        (["match", "a.log", "--reference", "0", "--scan", "1", "--initial", "here"],
         "--initial: 'here' is not of the form X,Y,DEG, as in 0.1,0,90, nor odometry or identity"),
        (["slam", "a.log", "--relations", "all"], "--relations: 'all' is not one of pairwise, nscan, both"),
    ],
)  # fmt: skip
def test_what_is_said(arguments, said, capsys):
    assert run(arguments) == 2
    name = arguments[0]
    assert capsys.readouterr().err == f"nscan-cli: {name}: {said}; see nscan-cli {name} --help\n"


FORMATS = {"render": "maps are PNG, PGM or HTML", "slam": "maps are PNG or PGM"}
"""What is said of the names of maps; all others are pictures."""


@pytest.mark.parametrize(
    "arguments",
    [
        ["render", "a.json", "-o", "map"],
        ["slam", "a.log", "-o", "a.json", "--map", "map"],
        ["match", "a.log", "--reference", "0", "--scan", "1", "--plot", "map"],
        ["evaluate", "a.json", "--reference", "a.tum", "--plot", "map"],
    ],
)
def test_a_picture_needs_a_name_that_says_so(arguments, capsys):
    assert run(arguments) == 2
    err = capsys.readouterr().err
    formats = FORMATS.get(arguments[0], "pictures are PNG")
    assert err.endswith(f": the name has no suffix; {formats}: name it map.png\n")
    assert run([each if each != "map" else "map.xyz" for each in arguments]) == 2
    assert capsys.readouterr().err.endswith(f"map.xyz: {formats}; name it like map.png\n")
    assert not list(Path().iterdir())


@pytest.mark.parametrize(
    "arguments",
    [["match", "a.log", "--reference", "0", "--scan", "1"], ["nscan", "a.log", "--scans", "0,1"]],
)
def test_a_result_needs_a_name_that_is_not_that_of_a_picture(arguments, capsys):
    assert run([*arguments, "-o", "out.png"]) == 2
    said = "out.png: has the name of a picture, but is the result in JSON; give --plot PICTURE.png"
    assert said in capsys.readouterr().err


def test_standard_output_and_devices_need_none(capsys):
    for output in ("-", os.devnull):
        assert run(["render", "a.json", "-o", output]) == 66
        assert "a.json: no such file" in capsys.readouterr().err
