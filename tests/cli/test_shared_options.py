from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

from nscan_cli.cli import main as frame
from nscan_cli.cli.main import run
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.subcommand import argument, option, subcommand
from nscan_cli.logs.reading_options import ReadingOptions


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[dict[str, Any]]:
    """What the command `info`, replaced by one that does nothing, is called with."""
    seen: list[dict[str, Any]] = []

    @subcommand("info")
    @argument("log", tells="a log")
    @option("-o", "--output", default="out.json")
    @option("--relations")
    @option("--map", "map_file")
    @option("--resolution", type=click.FloatRange(0, 10), default=0.05, metavar="M")
    @option("--yaml/--no-yaml", default=None)
    @reading_options
    @common_options
    def command(**values: Any) -> None:
        seen.append(values)

    monkeypatch.setattr(frame.LazyGroup, "get_command", lambda *_: command)
    monkeypatch.chdir(tmp_path)
    return seen


def called(calls: list[dict[str, Any]], *arguments: str) -> dict[str, Any]:
    assert run(["info", "some.log", *arguments]) == 0
    return calls.pop()


def config(text: str) -> tuple[str, str]:
    Path("settings.toml").write_text(text)
    return "--config", "settings.toml"


def test_defaults(calls):
    values = called(calls)
    assert values["reading"] == ReadingOptions()
    assert (values["output"], values["resolution"], values["yaml"]) == ("out.json", 0.05, None)
    assert (values["quiet"], values["verbose"]) == (False, 0)
    assert not {"config", "dump_config"} & set(values)


def test_reading_options_are_in_metres_and_radians(calls):
    reading = called(
        calls, "--laser", "RLASER", "--mount", "0.1,-0.2,90", "--flip", "--min-range", "0.2",
        "--max-range", "30", "--angle-min", "-90", "--angle-increment", "0.5", "--start", "1",
        "--end", "20", "--every", "3", "--no-odometry", "--strict", "--allow-corrected",
        "--topic", "/scan", "--odom-topic", "/odom", "--salvage", "--range-scale", "0.001",
        "--range-offset", "-0.05", "--as-recorded",
        "--odometry-scale", "0.001", "--clock-offset", "-30",
        "--mask", "130:150,-150:-130",
    )["reading"]  # fmt: skip
    assert reading == ReadingOptions(
        laser="RLASER", mount=(0.1, -0.2, math.pi / 2), flip=True, min_range=0.2, max_range=30.0,
        angle_min=-math.pi / 2, angle_increment=math.radians(0.5), start=1.0, end=20.0, every=3,
        odometry=False, strict=True, allow_corrected=True, topic="/scan", odom_topic="/odom", salvage=True,
        range_scale=0.001, range_offset=-0.05, as_recorded=True, odometry_scale=0.001, clock_offset=-30.0,
        mask=((math.radians(130), math.radians(150)), (math.radians(-150), math.radians(-130))),
    )  # fmt: skip


def test_flag_before_environment_before_toml_before_default(calls, monkeypatch):
    toml = config("resolution = 0.2\n")
    assert called(calls)["resolution"] == 0.05
    assert called(calls, *toml)["resolution"] == 0.2
    monkeypatch.setenv("NSCAN_CLI_RESOLUTION", "0.3")
    assert called(calls, *toml)["resolution"] == 0.3
    assert called(calls, *toml, "--resolution", "0.4")["resolution"] == 0.4


def test_the_environment_names_options_as_the_command_line_does(calls, monkeypatch):
    monkeypatch.setenv("NSCAN_CLI_MAP", "map.png")
    monkeypatch.setenv("NSCAN_CLI_NO_ODOMETRY", "1")
    monkeypatch.setenv("NSCAN_CLI_MOUNT", "1,2,0")
    values = called(calls)
    assert (values["map_file"], values["reading"].odometry) == ("map.png", False)
    assert values["reading"].mount == (1, 2, 0)
    monkeypatch.setenv("NSCAN_CLI_MAP_FILE", "other.png")
    assert called(calls)["map_file"] == "map.png"


def test_a_variable_of_one_command_goes_before_that_of_all(calls, monkeypatch, capsys):
    monkeypatch.setenv("NSCAN_CLI_EVERY", "3")
    monkeypatch.setenv("NSCAN_CLI_SLAM_EVERY", "4")
    assert called(calls)["reading"].every == 3
    monkeypatch.setenv("NSCAN_CLI_INFO_EVERY", "5")
    monkeypatch.setenv("NSCAN_CLI_INFO_FLIP", "1")
    assert called(calls)["reading"].every == 5
    assert called(calls)["reading"].flip
    assert called(calls, "--every", "6")["reading"].every == 6
    monkeypatch.setenv("NSCAN_CLI_INFO_EVERY", "often")
    assert run(["info", "some.log"]) == 2
    assert "NSCAN_CLI_INFO_EVERY in the environment: 'often' is not a whole number" in capsys.readouterr().err


def test_a_wrong_value_in_the_environment_is_said_to_be_there(calls, monkeypatch, capsys):
    monkeypatch.setenv("NSCAN_CLI_EVERY", "x")
    assert run(["info", "some.log"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("nscan-cli: info: NSCAN_CLI_EVERY in the environment: 'x' is not")
    assert run(["info", "some.log", "--every", "y"]) == 2
    assert "info: --every: 'y' is not a whole number; see" in capsys.readouterr().err


def test_the_config_may_come_after_other_options_and_from_the_environment(calls, monkeypatch):
    toml = config("resolution = 0.2\n")
    assert called(calls, "--flip", *toml)["resolution"] == 0.2
    monkeypatch.setenv("NSCAN_CLI_CONFIG", "settings.toml")
    assert called(calls)["resolution"] == 0.2


def test_a_table_of_the_command_goes_before_the_top_and_those_of_others_are_left_alone(calls):
    toml = config("resolution = 0.2\nno-odometry = true\n[info]\nresolution = 0.3\n[slam]\nnope = 1\n")
    values = called(calls, *toml)
    assert values["resolution"] == 0.3
    assert not values["reading"].odometry


def test_toml_values_of_every_kind(calls):
    toml = config(
        'mount = [0.1, 0, 90]\nevery = 2\nflip = true\nyaml = false\nlaser = "RLASER"\nmax-range = 30\n'
    )
    values = called(calls, *toml)
    assert values["reading"] == ReadingOptions(
        laser="RLASER", mount=(0.1, 0.0, math.pi / 2), flip=True, max_range=30.0, every=2
    )
    assert values["yaml"] is False


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("reslution = 0.1", "info has no option 'reslution'"),
        ("[info]\nquiet = true", "info has no option 'quiet'"),
        ("no_odometry = true", "info has no option 'no_odometry'"),
        ("info = 3", "info is not a table"),
        ("[other]\nresolution = 1", "info has no option 'other'"),
        ("resolution = nan", "resolution: 'nan' is not a finite number"),
        ("relations = 'both'", "relations is set for all commands, and has another meaning in each"),
        ("resolution = 'fine'", "resolution: 'fine' is not a number"),
        ("resolution = 11", "resolution: must be from 0 to 10 (m), but is 11"),
        ("resolution = true", "resolution: 'True' is not a number"),
        ("resolution = {a = 1}", "resolution: "),
        ("resolution = 2020-01-01", "resolution: '2020-01-01' is neither"),
        ("every = 1.5", "every: '1.5' is not a whole number"),
        ("flip = 3", "flip: '3' is neither true nor false"),
        ("mount = 3", "mount: '3' is not of the form X,Y,DEG"),
        ("mount = [1, 2]", "mount: '1,2' is not of the form X,Y,DEG"),
        ("mount = [1, 2, inf]", "mount: '1,2,inf' has a part that is not finite"),
        ("mask = 3", "mask: '3' is not of the form FROM:TO,..., as in 130:150,-150:-130"),
        ("resolution = ", "not TOML"),
        ("\xff", "not TOML"),
    ],
)
def test_bad_settings_are_named_with_their_file(calls, text, named, capsys):
    Path("settings.toml").write_bytes(text.encode("latin-1"))
    assert run(["info", "some.log", "--config", "settings.toml"]) == 65
    err = capsys.readouterr().err
    assert err.startswith("nscan-cli: settings.toml: ")
    assert named in err
    assert err.count("\n") == 1
    assert not calls


def test_a_missing_config_is_a_missing_input(calls, capsys):
    assert run(["info", "some.log", "--config", "absent.toml"]) == 66
    assert "absent.toml: no such file" in capsys.readouterr().err


@pytest.mark.parametrize("wrong", ["1,2", "1,2,3,4", "a,b,c", "", "nan,0,0"])
def test_a_mount_of_the_wrong_form_is_wrong_usage(calls, wrong, capsys):
    assert run(["info", "some.log", "--mount", wrong]) == 2
    assert "--mount" in capsys.readouterr().err


@pytest.mark.parametrize(
    "wrong", ["1", "1:2:3", "a:b", "", "nan:1", "1:2,", "1,2", "1:2@", "1:2@0", "1:2@inf", "1:2@1@2"]
)
def test_a_mask_of_the_wrong_form_is_wrong_usage(calls, wrong, capsys):
    assert run(["info", "some.log", "--mask", wrong]) == 2
    assert "--mask" in capsys.readouterr().err


def test_a_dumped_mask_gives_the_same_beams_again(calls, capsys):
    mask = called(calls, "--mask", "130.1:150,-150:-130@1.25")["reading"].mask
    capsys.readouterr()
    assert run(["info", "some.log", "--mask", "130.1:150,-150:-130@1.25", "--dump-config"]) == 0
    dumped = capsys.readouterr().out
    assert 'mask = ["130.1:150", "-150:-130@1.25"]' in dumped
    again = called(calls, *config(dumped))["reading"].mask
    assert [len(sector) for sector in again] == [2, 3]
    np.testing.assert_allclose(np.concatenate(again), np.concatenate(mask), rtol=1e-12)


def test_dumped_settings_give_the_same_call_again(calls, capsys):
    arguments = [
        "--mount", "0.1,-0.2,33.3", "--resolution", "0.1", "--no-yaml", "--every", "4", "--flip",
        "--start", "0.30", "--laser", 'odd "name" \\ with\ttab\x7f',
    ]  # fmt: skip
    values = called(calls, *arguments)
    capsys.readouterr()
    assert run(["info", "some.log", *arguments, "--dump-config"]) == 0
    assert not calls
    dumped = capsys.readouterr().out
    assert dumped.startswith("[info]\n")
    again = called(calls, *config(dumped))
    assert again["reading"].mount == pytest.approx(values["reading"].mount, rel=1e-15)
    for side in (values, again):
        side["reading"] = {**vars(side["reading"]), "mount": None}
    assert again == values
    assert run(["info", "some.log", *config(dumped), "--dump-config"]) == 0
    assert capsys.readouterr().out == dumped


def test_dumped_settings_include_environment_and_toml(calls, monkeypatch, capsys):
    monkeypatch.setenv("NSCAN_CLI_EVERY", "7")
    assert run(["info", "some.log", *config("max-range = 30"), "--dump-config"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "every = 7" in lines
    assert "max-range = 30.0" in lines
