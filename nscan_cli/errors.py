"""The errors that a user can cause; each carries its exit code and prints as one line."""

from nscan_cli.files.text import printable

LONGEST_MESSAGE = 2000
"""Characters of a message: it may quote an input, in which anything can stand."""


class NscanError(Exception):
    """A failure that the user can mend. The message names file, place and remedy."""

    exit_code = 1

    def __init__(self, message: str) -> None:
        message = printable(message)
        if len(message) > LONGEST_MESSAGE:
            message = f"{message[: LONGEST_MESSAGE // 2]} … {message[-LONGEST_MESSAGE // 2 :]}"
        super().__init__(message)


class InputDataError(NscanError):
    """What was read is not what it should be: a damaged file, a file of another kind."""

    exit_code = 65

    def __init__(self, file: str, problem: str, remedy: str, line: int | None = None) -> None:
        place = file if line is None else f"{file}, line {line}"
        super().__init__(f"{place}: {problem}; {remedy}")


class InputMissingError(NscanError):
    """An input that is not there or cannot be read."""

    exit_code = 66


class OutputError(NscanError):
    """An output that cannot be written."""

    exit_code = 73


class WrongUsageError(NscanError):
    """Options or arguments that do not fit each other or the log."""

    exit_code = 2


class CheckFailedError(NscanError):
    """The work is done, but a check that was asked for failed."""

    exit_code = 3
