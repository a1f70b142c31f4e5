"""Standard output and standard error, configured so that printing does not fail in any encoding."""

from __future__ import annotations

import codecs
import io
import json
import sys
from typing import Any

from nscan_cli.files.outputs import write_atomically
from nscan_cli.files.text import encode_fallback, json_bytes, printable

HANDLER = "nscan-cli"
"""Name of the encoding error handler of both streams."""


def configure_streams() -> None:
    """Replace characters that the encoding of a stream lacks."""
    if isinstance(raw := getattr(sys.stdout, "buffer", None), io.RawIOBase):
        # With PYTHONUNBUFFERED, output that a pipe does not accept at once is lost without an error.
        sys.stdout = io.TextIOWrapper(
            io.BufferedWriter(raw), sys.stdout.encoding, sys.stdout.errors, line_buffering=True
        )
    codecs.register_error(HANDLER, encode_fallback)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def print_json(facts: dict[str, Any]) -> None:
    """Print one JSON object to standard output, in UTF-8. Raises OutputError."""
    text = json.dumps(facts, ensure_ascii=False, allow_nan=False)
    write_atomically("-", json_bytes(f"{text}\n"))


def print_result(text: str) -> None:
    """Print text for people to standard output, in its encoding."""
    if sys.stdout is not None:
        sys.stdout.write(printable(text))
        sys.stdout.flush()
