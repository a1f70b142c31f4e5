"""JSON documents that commands write, and the line that says what is wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from nscan_cli.cli.main import run


def document_and_notices(
    command: str, capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[dict[str, Any], list[str]]:
    """The document of a command that writes one to standard output, and the lines of standard error."""
    assert run([command, *arguments]) == 0
    out, err = capsys.readouterr()
    document: dict[str, Any] = json.loads(out, parse_constant=pytest.fail)
    return document, [line for line in err.splitlines() if not line.startswith("compiling")]


def document_of(path: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(path.read_bytes(), parse_constant=pytest.fail)
    return document


def assert_error_line(capsys: pytest.CaptureFixture[str], said: str) -> None:
    """A command has printed one line on standard error, with these words, and nothing on standard output.

    Before it, the first command that needs kernels says that it compiles them.
    """
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("compiling")]
    assert (out, len(lines), lines[0][:11]) == ("", 1, "nscan-cli: ")
    assert said in lines[0]
