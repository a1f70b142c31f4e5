"""Errors that a user can cause. Each has an exit code, and is printed as one line."""

from nscan_cli.files.text import printable

LONGEST_MESSAGE = 2000
"""Maximum length of a message in characters, since it can quote an input."""


class NscanError(Exception):
    """A failure that the user can correct. The message names the file, the place and a remedy."""

    exit_code = 1

    def __init__(self, message: str) -> None:
        message = printable(message)
        if len(message) > LONGEST_MESSAGE:
            message = f"{message[: LONGEST_MESSAGE // 2]} … {message[-LONGEST_MESSAGE // 2 :]}"
        super().__init__(message)

    def __reduce__(self) -> tuple[object, ...]:
        """As it is, so that it comes back from another process. Its class may take other arguments."""
        return Exception.__new__, (type(self), *self.args), self.__dict__


class InputDataError(NscanError):
    """The content of an input is invalid: a damaged file, or one of another kind."""

    exit_code = 65

    def __init__(self, file: str, problem: str, remedy: str, line: int | None = None) -> None:
        place = file if line is None else f"{file}, line {line}"
        super().__init__(f"{place}: {problem}; {remedy}")


class InputMissingError(NscanError):
    """An input is missing or cannot be read."""

    exit_code = 66


class OutputError(NscanError):
    """An output cannot be written."""

    exit_code = 73


class WrongUsageError(NscanError):
    """Options or arguments contradict each other or the log."""

    exit_code = 2


class CheckFailedError(NscanError):
    """The command is done, but a requested check failed."""

    exit_code = 3
