"""Options that several commands have. A value comes from the flag, the environment, TOML or the default."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import json
import math
import os
from collections.abc import Callable, Sequence
from typing import Any

import click

from nscan_cli.cli.subcommand import ADVANCED, COMMAND_SPECIFIC, COMMON, READING, Option, Parsed, option
from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.inputs import read_toml
from nscan_cli.files.outputs import write_atomically
from nscan_cli.files.text import path_of_name
from nscan_cli.logs.reading_options import STAMPS, ReadingOptions, sector_text, sectors_from

Command = Callable[..., Any]
NOT_PARAMETERS = ("config", "dump_config", "quiet", "verbose")


def pose_from(text: str) -> tuple[float, float, float]:
    """The pose (x, y, θ), in m and rad, of a text X,Y,DEG. Raises ValueError if it is none."""
    try:
        x, y, degrees = (float(part) for part in text.split(","))
    except ValueError as error:
        raise ValueError(f"{text!r} is not of the form X,Y,DEG, as in 0.1,0,90") from error
    if not all(math.isfinite(part) for part in (x, y, degrees)):
        raise ValueError(f"{text!r} has a part that is not finite")
    return x, y, math.radians(degrees)


def _mask_from(text: str) -> tuple[tuple[float, ...], ...]:
    try:
        return sectors_from(text)
    except ValueError as error:
        raise ValueError(f"{text!r} is not of the form FROM:TO,..., as in 130:150,-150:-130") from error


def _sweep_from(text: str) -> float | None:
    if text in SWEEP_WORDS:
        return SWEEP_WORDS[text]
    with contextlib.suppress(ValueError):
        if math.isfinite(seconds := float(text)):
            return seconds
    raise ValueError(f"{text!r} is neither a time in seconds nor auto or off")


SWEEP_WORDS = {"auto": None, "off": 0.0}
POSE, MASK = Parsed("X,Y,DEG", pose_from), Parsed("FROM:TO,...", _mask_from)
SWEEP = Parsed("SECONDS|auto|off", _sweep_from)


def common_options(command: Command) -> Command:
    """Add -q, -v, --config and --dump-config; the command gets `quiet` and `verbose`."""

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        kwargs.pop("config")
        if kwargs.pop("dump_config"):
            write_atomically("-", _as_toml(click.get_current_context()).encode())
            return None
        return command(*args, **kwargs)

    say = functools.partial(option, section=COMMON)
    options = [
        say("-q", "--quiet", is_flag=True, help="Print errors only."),
        say("-v", "--verbose", count=True, help="Print more; -vv adds the traceback of an error."),
        say("--config", type=click.Path(), metavar="FILE.toml", is_eager=True, callback=_read_config,
            help="Read option values from a TOML file."),
        say("--dump-config", is_flag=True, help="Print the options in force as TOML, then exit."),
    ]  # fmt: skip
    return with_options(wrapped, options)


def with_options(command: Command, options: Sequence[Callable[[Command], Command]]) -> Command:
    """The command with the options, in this order in its help."""
    for decorator in reversed(options):
        command = decorator(command)
    return command


def reading_options(command: Command) -> Command:
    """Add the options of reading a log; the command gets them as `reading`, a ReadingOptions."""
    read, rare = (functools.partial(option, section=section) for section in (READING, ADVANCED))
    options = [
        read("--laser", metavar="TAG",
             help="Laser to use of a text log, such as FLASER or laser:0. Default: the only one."),
        read("--topic", metavar="TOPIC",
             help="Laser topic to use of an MCAP or bag, such as /scan. Default: the only one."),
        read("--odom-topic", metavar="TOPIC",
             help="Odometry topic to use, such as /odom or /tf. Default: the only one, or tf."),
        read("--mount", type=POSE,
             help="Pose of the laser on the robot (m, degrees). Default: that in the log."),
        read("--flip", is_flag=True, help="The laser is mounted upside down."),
        read("--min-range", type=click.FloatRange(0), metavar="M",
             help="Drop shorter readings. Default: the limit in the log."),
        read("--max-range", type=click.FloatRange(0, min_open=True), metavar="M",
             help="Treat longer readings as no return. Default: the limit in the log."),
        read("--start", type=float, metavar="T", help="Skip the first T seconds. Default: 0."),
        read("--end", type=float, metavar="T",
             help="Stop T seconds after the first scan. Default: at the last scan."),
        read("--every", type=click.IntRange(1), default=1, show_default=True, metavar="N",
             help="Use every Nth scan."),
        read("--no-odometry", is_flag=True, help="Ignore odometry."),
        rare("--range-scale", type=click.FloatRange(0, min_open=True), metavar="F",
             help="Multiply the ranges: 0.001 for millimetres. Default: 1, or what the ranges show."),
        rare("--range-offset", type=float, metavar="M",
             help="Add to the ranges. Default: 0, or what straight walls show."),
        rare("--angle-min", type=float, metavar="DEG",
             help="Direction of the first beam. Default: that in the log."),
        rare("--angle-increment", type=float, metavar="DEG",
             help="Angle from beam to beam. Default: that in the log."),
        rare("--mask", type=MASK,
             help="Drop beams between bearings (degrees, counter-clockwise); with @M only readings "
             "nearer than M metres. Default: those that see the robot."),
        rare("--sweep", type=SWEEP, metavar=SWEEP.name, default="auto", show_default=True,
             help="Seconds of a full turn of the laser, so that each beam has its own time; negative if the "
             "readings are in the reverse order of time. off: all at once. auto: as the log says."),
        rare("--stamp", type=click.Choice(STAMPS), default="first", show_default=True,
             help="Beam of the turn at whose time a scan is stamped."),
        rare("--odometry-scale", type=float, default=1.0, show_default=True, metavar="F",
             help="Multiply the positions of odometry: 0.001 for millimetres, -1 for forward counted as "
             "backward."),
        rare("--clock-offset", type=float, default=0.0, show_default=True, metavar="SECONDS",
             help="Add this to the time stamps of odometry."),
        rare("--strict", is_flag=True, help="Treat a malformed record as an error, not as a warning."),
        rare("--salvage", is_flag=True, help="Use the readable part of a damaged or cut-off file."),
        rare("--allow-corrected", is_flag=True,
             help="Use poses that a mapper has already corrected as odometry."),
        rare("--as-recorded", is_flag=True, help="Correct nothing, even if the scans contradict the log."),
    ]  # fmt: skip

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        kwargs["odometry"] = not kwargs.pop("no_odometry")
        values = {each.name: kwargs.pop(each.name) for each in dataclasses.fields(ReadingOptions)}
        for angle in ("angle_min", "angle_increment"):
            if values[angle] is not None:
                values[angle] = math.radians(values[angle])
        return command(*args, reading=ReadingOptions(**values), **kwargs)

    return with_options(wrapped, options)


def _read_config(ctx: click.Context, _param: click.Parameter, value: str | None) -> str | None:
    """Use the values of a TOML file as the command's defaults.

    Keys at the top and in the command's table are long options without dashes. Options at the top that only
    other commands have, and the tables of other commands, are ignored.
    """
    if value is None:
        return None
    document = read_toml(value, "correct it, or leave out --config")
    from nscan_cli.cli.main import COMMANDS

    name = ctx.command.name or ""
    own = document.get(name, {})
    if not isinstance(own, dict):
        raise InputDataError(value, f"{name} is not a table", f"write [{name}], and its options below")
    options = {param.long_name: param for param in _parameters(ctx.command)}
    settings = {key: entry for key, entry in document.items() if key not in COMMANDS}
    for key in list(settings):
        if key in COMMAND_SPECIFIC:
            tables = " or ".join(f"[{command}]" for command in _commands_having(key))
            problem = f"{key} is set for all commands, and has another meaning in each"
            raise InputDataError(value, problem, f"set it below {tables}")
        if key not in options and _commands_having(key):
            del settings[key]
    settings.update(own)
    defaults = {}
    for key, entry in settings.items():
        if key not in options:
            raise InputDataError(
                value, f"{name} has no option {key!r}", f"known: {', '.join(sorted(options)) or 'none'}"
            )
        try:
            options[key].type_cast_value(ctx, _as_argument(entry))
        except click.BadParameter as error:
            raise InputDataError(
                value, f"{key}: {error.message.rstrip('.')}", f"see {ctx.command_path} --help"
            ) from error
        defaults[options[key].name] = _as_argument(entry)
    ctx.default_map = {**(ctx.default_map or {}), **defaults}
    return value


def _commands_having(key: str) -> list[str]:
    """The commands with an option of this long name that a TOML file can set."""
    from nscan_cli.cli.main import COMMANDS, cli

    context = click.Context(cli)
    commands = {name: cli.get_command(context, name) for name in COMMANDS}
    return [
        name
        for name, command in commands.items()
        if command is not None and key in (param.long_name for param in _parameters(command))
    ]


def _as_argument(entry: Any) -> str:
    """A TOML value as it is typed on the command line. Raises BadParameter for dates and tables."""
    if isinstance(entry, list):
        return ",".join(_as_argument(part) for part in entry)
    if isinstance(entry, (str, int, float)):
        return path_of_name(str(entry))
    raise click.BadParameter(f"{str(entry)!r} is neither text, number, true, false nor a list of them")


def _parameters(command: click.Command) -> list[Option]:
    """The options of a command that a TOML file can set, in the order of --help."""
    return [
        param for param in command.params if isinstance(param, Option) and param.name not in NOT_PARAMETERS
    ]


def _as_toml(ctx: click.Context) -> str:
    """The command's options in force as a TOML table of its name."""
    lines = [f"[{ctx.command.name}]"]
    for param in _parameters(ctx.command):
        value = ctx.params.get(param.name or "")
        if value is None or value == ():
            continue
        if param.type is POSE:
            value = [value[0], value[1], math.degrees(value[2])]
        elif param.type is MASK:
            value = [sector_text(sector) for sector in value]
        elif isinstance(value, str):
            try:
                value = os.fsencode(value).decode()
            except UnicodeError as error:
                problem = f"--dump-config: {value} is not UTF-8, which TOML needs; choose another name"
                raise WrongUsageError(problem) from error
        # JSON writes such values as TOML does, except that TOML escapes DEL.
        text = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        lines.append(f"{param.long_name} = {text}")
    return "\n".join(lines) + "\n"
