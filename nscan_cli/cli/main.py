"""The command `nscan-cli`: finds the subcommand, and turns every failure into a line and an exit code."""

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
from nscan_cli.cli.usage_wording import usage_problem
from nscan_cli.errors import InputDataError, NscanError, OutputError
from nscan_cli.files.text import printable

COMMANDS = {
    "info": "Tell what is in a log, and what the other commands will use of it.",
    "match": "Match two scans of a log (NDT).",
    "nscan": "Match n scans of a log jointly.",
    "slam": "Turn a log into a pose graph and a map.",
    "render": "Draw the map of a pose graph.",
    "evaluate": "Measure a result against reference relations or a reference trajectory.",
    "nightly": "Map and measure many logs, and report what has changed.",
}
INTERRUPTED, CLOSED_EARLY, INTERNAL_ERROR = 130, 141, 1
COMPLETION_VARIABLE = "_NSCAN_CLI_COMPLETE"
"""The variable by which a shell asks what a line can go on with."""
GC_THRESHOLD = 50_000
"""So many new ones before the garbage collection looks for what can go. Python's own 700 have it look through
all that the imports make again and again, and of that nothing ever goes."""
WRITE_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


class LazyGroup(click.Group):
    """Subcommands are imported when they are called; the list of them needs no import."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names in the order of a user's work, not of the alphabet."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command's module is `nscan_cli.cli.NAME`, the command in it `command`."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"nscan_cli.cli.{cmd_name}")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Examples, and what holds for all commands."""
        write_examples(formatter, EXAMPLES)
        with formatter.section("Exit codes"):
            formatter.write_dl([(str(code), meaning) for code, meaning in EXIT_CODES.items()])
        with formatter.section("Environment"):
            formatter.write_dl(list(ENVIRONMENT.items()))


@click.group(cls=LazyGroup, context_settings=CONTEXT)
@click.version_option(__version__, prog_name="nscan-cli")
def cli() -> None:
    """Turn 2D laser logs into globally consistent maps by nScan-Matching.

    Results go to files, or to standard output with -o -; what people read goes to standard error.
    nscan-cli COMMAND --help tells about a command.
    """


def main() -> None:
    """Entry point of the command; exits with the code of the outcome."""
    gc.set_threshold(GC_THRESHOLD)
    configure_streams()
    code = run(sys.argv[1:])
    # What is left goes with the process: at its end, Python need not look for what it could free.
    gc.freeze()
    if code == INTERRUPTED:
        # Python would wait for threads whose work nobody wants any more.
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(code)
    if code in (CLOSED_EARLY, OutputError.exit_code) and sys.stdout is not None:
        # What cannot be written, Python would try once more at its end, and complain.
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run the command line `arguments` and return its exit code."""
    verbose = "-vv" in arguments or arguments.count("-v") > 1
    # The matrices here are small: more threads make them slower, and the last digits depend on how many.
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
        # Without its standalone mode, click itself exits for completions and for a closed pipe alone.
        if COMPLETION_VARIABLE in os.environ and isinstance(error, SystemExit):
            return int(error.code or 0)
        return CLOSED_EARLY
    except NscanError as error:
        _print_error(str(error), verbose)
        return error.exit_code
    except MemoryError:
        _print_error("there is not enough memory for this; see --every, --start and --end", verbose)
        return InputDataError.exit_code
    except Exception as error:
        if _is_interrupt(error):
            # As click does, which ends the line in which a terminal shows ^C.
            print(file=sys.stderr)
            return INTERRUPTED
        if isinstance(error, OSError) and error.errno in WRITE_ERRNOS and error.filename is None:
            _print_error(f"standard output: cannot be written: {error.strerror}", verbose)
            return OutputError.exit_code
        hint = "" if verbose else "; -vv shows where"
        _print_error(f"internal error, please report it: {type(error).__name__}: {error}{hint}", verbose)
        return INTERNAL_ERROR


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: Python wraps one that comes while a class is made."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _usage_line(error: click.ClickException) -> str:
    """What click says in several lines, in one."""
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
