"""The command `nscan-cli`: runs a subcommand, and turns each failure into one line and an exit code."""

from __future__ import annotations

import contextlib
import errno
import gc
import importlib
import os
import sys
import traceback

import click

from nscan_cli import __version__
from nscan_cli.cli.manual import ENVIRONMENT, EXAMPLES, EXIT_CODES
from nscan_cli.cli.standard_streams import configure_streams
from nscan_cli.cli.subcommand import CONTEXT, write_examples
from nscan_cli.cli.usage_errors import usage_problem
from nscan_cli.errors import InputDataError, NscanError, OutputError
from nscan_cli.files.text import printable

COMMANDS = {
    "info": "Show what a log contains, and what the other commands use of it.",
    "calibrate": "Find how the laser is mounted and what odometry does, from the scans.",
    "match": "Match two scans of a log (NDT).",
    "nscan": "Match several scans of a log jointly (nScan-Matching). Also called match-jointly.",
    "slam": "Build a pose graph and a map from a log.",
    "render": "Draw the map of a pose graph.",
    "evaluate": "Compare a result with reference relations or a reference trajectory.",
    "nightly": "Map and evaluate many logs, and report what has changed.",
    "schema": "Print the JSON Schema of the graph file.",
    "warm-up": "Compile all numerical code now, so that no later run has to.",
}
ALIASES = {"match-jointly": "nscan"}
"""Other names of commands, which explain themselves."""
INTERRUPTED, CLOSED_EARLY, INTERNAL_ERROR = 130, 141, 1
COMPLETION_VARIABLE = "_NSCAN_CLI_COMPLETE"
"""The variable by which a shell asks for completions."""
GC_THRESHOLD = 50_000
"""New objects before a garbage collection. With Python's 700, imports cause many collections that free
nothing."""
WRITE_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


class LazyGroup(click.Group):
    """Imports a subcommand only when it is called; the list of them needs no import."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names in the order of use, not of the alphabet."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The object `command` of the module `nscan_cli.cli.NAME`, also by an alias."""
        name = ALIASES.get(cmd_name, cmd_name)
        if name not in COMMANDS:
            return None
        module = importlib.import_module(f"nscan_cli.cli.{name.replace('-', '_')}")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write examples, exit codes and environment variables."""
        write_examples(formatter, EXAMPLES)
        with formatter.section("Exit codes"):
            formatter.write_dl([(str(code), meaning) for code, meaning in EXIT_CODES.items()])
        with formatter.section("Environment"):
            formatter.write_dl(list(ENVIRONMENT.items()))


@click.group(cls=LazyGroup, context_settings=CONTEXT)
@click.version_option(__version__, prog_name="nscan-cli")
def cli() -> None:
    """Build globally consistent maps from 2D laser logs by nScan-Matching.

    Results go to files, or to standard output with -o -. Messages go to standard error.
    nscan-cli COMMAND --help describes a command.
    """


def main() -> None:
    """Entry point of the command; exits with its exit code."""
    gc.set_threshold(GC_THRESHOLD)
    configure_streams()
    code = run(sys.argv[1:])
    # Python need not look for garbage when the process ends.
    gc.freeze()
    if code == INTERRUPTED:
        # A normal exit would wait for threads whose work is no longer wanted.
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(code)
    if code in (CLOSED_EARLY, OutputError.exit_code) and sys.stdout is not None:
        # At exit, Python would try to write the rest once more, and print an error.
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run the command line `arguments` and return its exit code."""
    verbose = "-vv" in arguments or arguments.count("-v") > 1
    # Small matrices are slower with several threads, and last digits depend on the number of threads.
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    try:
        if COMPLETION_VARIABLE in os.environ:
            from nscan_cli.cli.completion import add_completions

            add_completions()
        outcome = cli.main(
            arguments, prog_name="nscan-cli", complete_var=COMPLETION_VARIABLE, standalone_mode=False
        )
        if sys.stdout is not None:
            sys.stdout.flush()
        return outcome if isinstance(outcome, int) else 0
    except click.exceptions.Exit as exit_:
        return exit_.exit_code
    except (click.Abort, KeyboardInterrupt):
        return INTERRUPTED
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return error.exit_code
    except click.ClickException as error:
        _print_error(_usage_line(error), verbose)
        return error.exit_code
    except (BrokenPipeError, SystemExit) as error:
        # Without standalone mode, click exits only for completions and for a closed pipe.
        if COMPLETION_VARIABLE in os.environ and isinstance(error, SystemExit):
            return int(error.code or 0)
        return CLOSED_EARLY
    except NscanError as error:
        _print_error(str(error), verbose)
        return error.exit_code
    except MemoryError:
        _print_error("not enough memory; use less of the log by --every, --start and --end", verbose)
        return InputDataError.exit_code
    except Exception as error:
        if _is_interrupt(error):
            # End the line in which the terminal shows ^C, as click does.
            print(file=sys.stderr)
            return INTERRUPTED
        if isinstance(error, OSError) and error.errno in WRITE_ERRNOS and error.filename is None:
            _print_error(f"standard output: cannot be written: {error.strerror}", verbose)
            return OutputError.exit_code
        hint = "" if verbose else "; -vv shows the traceback"
        _print_error(f"internal error, please report it: {type(error).__name__}: {error}{hint}", verbose)
        return INTERNAL_ERROR


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error: Python wraps one that occurs while a class is created."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _usage_line(error: click.ClickException) -> str:
    problem = usage_problem(error)
    context = getattr(error, "ctx", None)
    if context is None:
        return problem
    command = context.command_path.partition(" ")[2]
    return f"{command}: {problem}".removeprefix(": ") + f"; see {context.command_path} --help"


def _print_error(message: str, with_traceback: bool) -> None:
    if with_traceback:
        traceback.print_exc()
    print(f"nscan-cli: {' '.join(printable(message).split())}", file=sys.stderr)
