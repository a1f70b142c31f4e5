"""Usage errors in one line of plain words, instead of those of click."""

from __future__ import annotations

from typing import Any

import click

from nscan_cli.files.text import listed

SUBCOMMAND_OPTIONS = ("-q", "--quiet", "-v", "--verbose", "--config", "--dump-config")
"""Options that stand after the name of a command, not before it."""
METAVAR_UNITS = {"M": "m", "DEG": "degrees", "T": "s", "SECONDS": "s"}
"""Units of numbers by their metavar in the help."""


def value_problem(kind: click.ParamType[Any], value: Any, metavar: str | None) -> str | None:
    """The problem with a value that a type of click refuses; None for types with messages of their own.

    `metavar` is the placeholder of the value in the help.
    """
    if isinstance(kind, click.Choice):
        return f"{value!r} is not one of {', '.join(map(str, kind.choices))}"
    if isinstance(kind, click.types.BoolParamType):
        return f"{value!r} is neither true nor false"
    whole = isinstance(kind, click.types.IntParamType)
    if not whole and not isinstance(kind, click.types.FloatParamType):
        return None
    try:
        number = int(value) if whole else float(value)
    except (ValueError, TypeError, OverflowError):
        return f"{value!r} is not a {'whole ' if whole else ''}number"
    unit = METAVAR_UNITS.get(metavar or "")
    return f"must be {_range_text(kind)}{f' ({unit})' if unit else ''}, but is {number:g}"


def _range_text(kind: Any) -> str:
    low, high = kind.min, kind.max
    if low is not None and high is not None and not kind.min_open and not kind.max_open:
        return f"from {low:g} to {high:g}"
    at_least = "" if low is None else f"above {low:g}" if kind.min_open else f"{low:g} or more"
    at_most = "" if high is None else f"below {high:g}" if kind.max_open else f"{high:g} or less"
    return " and ".join(bound for bound in (at_least, at_most) if bound)


def _options_begun(error: click.NoSuchOption) -> list[str]:
    params = [] if error.ctx is None else error.ctx.command.params
    names = (name for param in params if isinstance(param, click.Option) for name in param.opts)
    return [name for name in names if name.startswith(error.option_name)]


def usage_problem(error: click.ClickException) -> str:
    """The message of click, without its full stop."""
    if isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter):
        place = error.param_hint or (error.param.get_error_hint(error.ctx) if error.param else "")
        return f"{place}: {error.message.rstrip('.')}".removeprefix(": ")
    if isinstance(error, click.NoSuchOption) and error.option_name in SUBCOMMAND_OPTIONS:
        return f"{error.option_name} stands after the command's name"
    if isinstance(error, click.NoSuchOption) and (begun := _options_begun(error)):
        return f"No such option {error.option_name!r}, but there is {listed(begun, 'and')}"
    return error.format_message().rstrip(".")
