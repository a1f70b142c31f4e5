"""The base of all subcommands: help in sections with examples, and options that the environment can set."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import click
from click.core import ParameterSource

from nscan_cli.cli.usage_errors import value_problem
from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.formats import readable_forms

CONTEXT: dict[str, Any] = {"help_option_names": ["-h", "--help"]}
# All commands share the prefix, so a shell or a Makefile can set an option for all of them at once.
VARIABLE_PREFIX = "NSCAN_CLI_"
ARGUMENTS, OWN, READING, ADVANCED, COMMON = (
    "Arguments", "Options", "Reading the log", "Advanced", "For all commands"
)  # fmt: skip
SECTIONS = (ARGUMENTS, OWN, READING, ADVANCED, COMMON)
"""The sections of the help, in order."""
COMMAND_SPECIFIC = {"initial", "output", "plot", "prior", "reference", "relations", "trajectory"}
"""Long names of options with another meaning in each command. A variable without the command's name does not
set them, and neither does a key at the top of a TOML file."""
PATH = click.Path()
"""The type of file names, which shells complete; "-" is allowed."""

Example = tuple[str, str]
"""A command line, and its purpose."""


class Option(click.Option):
    """An option in a section of the help, which environment variables set, too."""

    def __init__(self, *args: Any, section: str = OWN, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.section = section
        self.envvar: str = VARIABLE_PREFIX + _upper_case(self.long_name)

    @property
    def long_name(self) -> str:
        """The name of the option on the command line and in a TOML file, without its dashes."""
        return max(self.opts, key=len).lstrip("-")

    def variables(self, ctx: click.Context) -> list[str]:
        """The environment variables that set it, the command's own first."""
        own = f"{VARIABLE_PREFIX}{_upper_case(ctx.command.name or '')}_{_upper_case(self.long_name)}"
        return [own] if self.long_name in COMMAND_SPECIFIC else [own, self.envvar]

    def resolve_envvar_value(self, ctx: click.Context) -> str | None:
        """The value of the first of its variables that is set and not empty.

        Raises WrongUsageError if only the variable for all commands is set, and the option has another
        meaning in each.
        """
        variables = self.variables(ctx)
        value = next((value for name in variables if (value := os.environ.get(name))), None)
        if value is None and os.environ.get(self.envvar) and not ctx.resilient_parsing:
            raise WrongUsageError(
                f"{self.envvar} in the environment: --{self.long_name} has another meaning in each command; "
                f"set {variables[0]} instead"
            )
        return value

    def consume_value(self, ctx: click.Context, opts: Mapping[str, Any]) -> tuple[Any, ParameterSource]:
        """The value and its source, which is kept for error messages."""
        value, source = super().consume_value(ctx, opts)
        ctx.meta[f"{__name__}.{self.name}"] = source
        return value, source

    def type_cast_value(self, ctx: click.Context, value: Any) -> Any:
        """The value as the command gets it. Raises BadParameter, also for nan and inf."""
        try:
            found = super().type_cast_value(ctx, value)
        except click.BadParameter as error:
            problem = value_problem(self.type, value, self.metavar) or error.message
            raise click.BadParameter(problem, ctx, self) from error
        if isinstance(found, float) and not math.isfinite(found):
            raise click.BadParameter(f"{value!r} is not a finite number", ctx, self)
        return found

    def get_error_hint(self, ctx: click.Context | None) -> str:
        """The name of the option in messages, or of the variable that has set it."""
        if ctx and ctx.meta.get(f"{__name__}.{self.name}") is ParameterSource.ENVIRONMENT:
            variable = next(name for name in self.variables(ctx) if os.environ.get(name))
            return f"{variable} in the environment"
        return f"--{self.long_name}"


def _upper_case(name: str) -> str:
    return name.upper().replace("-", "_")


class Parsed(click.ParamType[Any]):
    """The type of values in a form of their own, which a function reads. Its ValueError is a usage error."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name, self.parse = name, parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """What the function makes of the value."""
        try:
            return self.parse(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class Argument(click.Argument):
    """An argument with a help text."""

    section = ARGUMENTS

    def __init__(self, *args: Any, tells: str, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.tells = tells

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        """Its name and its help text."""
        return self.make_metavar(ctx), self.tells


option = functools.partial(click.option, cls=Option)
argument = functools.partial(click.argument, cls=Argument)
log_argument = functools.partial(
    argument,
    "log",
    nargs=-1,
    required=True,
    type=PATH,
    tells=f"A laser log: {readable_forms()}. - is standard input. Several files of one recording, or a "
    "folder written by `ros2 bag record`, count as one log.",
)

result_option = option(
    "-o", "--output", type=PATH, default="-", metavar="RESULT.json",
    help="File for the result. Default: standard output.",
)  # fmt: skip
"""The output option of commands whose result is a short document."""
json_option = option("--json", "as_json", is_flag=True, help="Print one JSON object (m, s, degrees).")
"""The option of commands that can print their result or their summary for a program."""


class Subcommand(click.Command):
    """A command whose help has examples, and its options in sections."""

    def __init__(self, *args: Any, examples: Sequence[Example] = (), **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.examples = examples

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write arguments, the command's own options, then shared options."""
        for title in SECTIONS:
            if records := self.records(ctx, title):
                with formatter.section(title):
                    formatter.write_dl(records)

    def format_arguments(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write nothing: `format_options` writes the arguments. click 8.5.0 would write them twice."""

    def records(self, ctx: click.Context, title: str) -> list[tuple[str, str]]:
        """The parameters of a section: each one's name in the help, and its help text."""
        found = (
            parameter.get_help_record(ctx)
            for parameter in self.get_params(ctx)
            if section_of(parameter) == title
        )
        return [record for record in found if record]

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the examples."""
        write_examples(formatter, self.examples)


def write_examples(formatter: click.HelpFormatter, examples: Sequence[Example]) -> None:
    """Write a section with command lines, unbroken, so that they can be copied."""
    with formatter.section("Examples"):
        for line, purpose in examples:
            formatter.write_text(f"# {purpose}")
            formatter.write(f"{'':{formatter.current_indent}}{line}\n")


def section_of(parameter: click.Parameter) -> str:
    """The section of the help that a parameter belongs to; --help is in COMMON."""
    return parameter.section if isinstance(parameter, (Argument, Option)) else COMMON


def subcommand(name: str, *examples: Example) -> Callable[[Callable[..., Any]], Subcommand]:
    """Decorator: make a function the subcommand `name`."""
    return click.command(name, cls=Subcommand, context_settings=CONTEXT, examples=examples)
