"""Standard output and standard error: whatever their encoding, nothing that is printed stops the work."""

from __future__ import annotations

import codecs
import io
import sys

from nscan_cli.files.text import encode_fallback, printable

HANDLER = "nscan-cli"
"""Name of the error handler of both streams."""


def configure_streams() -> None:
    """Let characters that an encoding lacks be printed in others."""
    if isinstance(raw := getattr(sys.stdout, "buffer", None), io.RawIOBase):
        # With PYTHONUNBUFFERED, what a pipe does not take at once would be lost without an error.
        sys.stdout = io.TextIOWrapper(
            io.BufferedWriter(raw), sys.stdout.encoding, sys.stdout.errors, line_buffering=True
        )
    codecs.register_error(HANDLER, encode_fallback)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def print_result(text: str) -> None:
    """Print to standard output, in its own encoding, what is for people."""
    if sys.stdout is not None:
        sys.stdout.write(printable(text))
        sys.stdout.flush()
