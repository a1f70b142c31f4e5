"""What every subcommand has: help in sections, with examples, and options that the environment sets too."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import click
from click.core import ParameterSource

from nscan_cli.cli.usage_wording import value_problem
from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.formats import readable

CONTEXT: dict[str, Any] = {"help_option_names": ["-h", "--help"]}
# One prefix for all commands: what is set once in a shell or a Makefile holds for each of them.
VARIABLE_PREFIX = "NSCAN_CLI_"
ARGUMENTS, OWN, READING, COMMON = "Arguments", "Options", "Reading the log", "For all commands"
SECTIONS = (ARGUMENTS, OWN, READING, COMMON)
"""Of the help, in this order."""
COMMAND_SPECIFIC = {"initial", "output", "plot", "prior", "reference", "relations", "trajectory"}
"""Long names of options that mean another thing in another command. What is set for all commands sets none of
them: neither a variable without the command's name nor a key at the top of a TOML file."""
PATH = click.Path()
"""A file's name, which a shell can complete; "-" too."""

Example = tuple[str, str]
"""A command line, and what it is for."""


class Option(click.Option):
    """An option of a section of the help, which PREFIX with its long name in capitals sets too."""

    def __init__(self, *args: Any, section: str = OWN, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.section = section
        self.envvar: str = VARIABLE_PREFIX + _upper_case(self.long_name)

    @property
    def long_name(self) -> str:
        """The name of the option on the command line and in a TOML file, without its dashes."""
        return max(self.opts, key=len).lstrip("-")

    @property
    def is_shared(self) -> bool:
        """Whether it means the same in all commands that have it."""
        return self.long_name not in COMMAND_SPECIFIC

    def variables(self, ctx: click.Context) -> list[str]:
        """Those that set it, the command's own first."""
        own = f"{VARIABLE_PREFIX}{_upper_case(ctx.command.name or '')}_{_upper_case(self.long_name)}"
        return [own, self.envvar] if self.is_shared else [own]

    def resolve_envvar_value(self, ctx: click.Context) -> str | None:
        """The value of the first of its variables that is set to something.

        Raises WrongUsageError where only one is set that would have to mean several things.
        """
        variables = self.variables(ctx)
        value = next((value for name in variables if (value := os.environ.get(name))), None)
        if value is None and os.environ.get(self.envvar) and not ctx.resilient_parsing:
            raise WrongUsageError(
                f"{self.envvar} in the environment: --{self.long_name} means another thing in each command; "
                f"set {variables[0]} instead"
            )
        return value

    def consume_value(self, ctx: click.Context, opts: Mapping[str, Any]) -> tuple[Any, ParameterSource]:
        """The value and where it is from, which a message about it has to know."""
        value, source = super().consume_value(ctx, opts)
        ctx.meta[f"{__name__}.{self.name}"] = source
        return value, source

    def type_cast_value(self, ctx: click.Context, value: Any) -> Any:
        """The value as the command gets it. Raises BadParameter, in our words, also for nan and inf."""
        try:
            found = super().type_cast_value(ctx, value)
        except click.BadParameter as error:
            problem = value_problem(self.type, value, self.metavar) or error.message
            raise click.BadParameter(problem, ctx, self) from error
        if isinstance(found, float) and not math.isfinite(found):
            raise click.BadParameter(f"{value!r} is not a finite number", ctx, self)
        return found

    def get_error_hint(self, ctx: click.Context | None) -> str:
        """The option as messages name it; the variable where the value is from there."""
        if ctx and ctx.meta.get(f"{__name__}.{self.name}") is ParameterSource.ENVIRONMENT:
            variable = next(name for name in self.variables(ctx) if os.environ.get(name))
            return f"{variable} in the environment"
        return f"--{self.long_name}"


def _upper_case(name: str) -> str:
    """The part of a variable's name that stands for a command or an option."""
    return name.upper().replace("-", "_")


class Argument(click.Argument):
    """An argument that the help tells about."""

    section = ARGUMENTS

    def __init__(self, *args: Any, tells: str, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.tells = tells

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        """Its name, and what it is."""
        return self.make_metavar(ctx), self.tells


option = functools.partial(click.option, cls=Option)
argument = functools.partial(click.argument, cls=Argument)
log_argument = functools.partial(
    argument,
    "log",
    nargs=-1,
    required=True,
    type=PATH,
    tells=f"A laser log: {readable()}. - is standard input. A folder that `ros2 bag record` has left, and "
    "several files of one recording, are one log.",
)

result_option = option(
    "-o",
    "--output",
    type=PATH,
    default="-",
    metavar="RESULT.json",
    help="The result; standard output if not given.",
)
"""Of commands whose result is a short document."""


class Subcommand(click.Command):
    """A command with examples, whose help lists the options in sections."""

    def __init__(self, *args: Any, examples: Sequence[Example] = (), **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.examples = examples

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Arguments, the options that the command alone has, and those that others have too."""
        for title in SECTIONS:
            if records := self.records(ctx, title):
                with formatter.section(title):
                    formatter.write_dl(records)

    def records(self, ctx: click.Context, title: str) -> list[tuple[str, str]]:
        """Each parameter of a section as the help shows it, and what the help says of it."""
        found = (
            parameter.get_help_record(ctx)
            for parameter in self.get_params(ctx)
            if section_of(parameter) == title
        )
        return [record for record in found if record]

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The examples."""
        write_examples(formatter, self.examples)


def write_examples(formatter: click.HelpFormatter, examples: Sequence[Example]) -> None:
    """A section of the help with command lines that can be copied: none is broken."""
    with formatter.section("Examples"):
        for line, purpose in examples:
            formatter.write_text(f"# {purpose}")
            formatter.write(f"{'':{formatter.current_indent}}{line}\n")


def section_of(parameter: click.Parameter) -> str:
    """The section of the help that an option is in; --help is everybody's."""
    return parameter.section if isinstance(parameter, (Argument, Option)) else COMMON


def subcommand(name: str, *examples: Example) -> Callable[[Callable[..., Any]], Subcommand]:
    """The decorator that makes a function the subcommand `name`."""
    return click.command(name, cls=Subcommand, context_settings=CONTEXT, examples=examples)
