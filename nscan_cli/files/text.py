"""Text of messages, which can be printed in any encoding. Names of files can be bytes that are not UTF-8."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

LONE_SURROGATES = re.compile("[\ud800-\udc7f\udd00-\udfff]")
"""Lone surrogates that do not stand for a byte of a file name; JSON text can have them."""
ASCII_FORMS = {
    "°": " deg", "±": "+-", "×": "x", "·": "*", "→": "->", "←": "<-", "−": "-", "–": "-", "…": "...",
    "≤": "<=", "≥": ">=", "²": "^2", "√": "sqrt ", "Δ": "delta ", "θ": "theta", "φ": "phi", "σ": "sigma",
}  # fmt: skip
"""Replacements of characters in messages for encodings that lack them."""


def printable(text: str) -> str:
    r"""The text with bytes of file names that are not UTF-8 escaped, as in `\xff.log`."""
    if text.isascii():
        return text
    whole = LONE_SURROGATES.sub(lambda found: f"\\u{ord(found[0]):04x}", text)
    return whole.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def counted(count: int, thing: str) -> str:
    """The count and the name of the thing, in the plural unless the count is 1."""
    if count == 1:
        return f"1 {thing}"
    return f"{count} {thing}{'es' if thing.endswith(('s', 'x', 'ch', 'sh')) else 's'}"


def shortened_list(names: Sequence[str], thing: str = "other", most: int = 5, separator: str = ", ") -> str:
    """The first names of a list, `most` of them, and how many other things there are."""
    more = f" and {counted(len(names) - most, thing)}" if len(names) > most else ""
    return separator.join(names[:most]) + more


def listed(names: Sequence[str], last: str) -> str:
    """All names of a list, with the word `last` before the last one: "a, b or c"."""
    return f" {last} ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def name_of_path(path: str) -> str:
    """The name of a file in results: without its folder, and the same text on every machine."""
    return printable(os.fsencode(Path(path).name).decode("utf-8", "surrogateescape"))


def path_of_name(name: str) -> str:
    """The path in Python of a file named in a UTF-8 document, on a machine of any encoding."""
    try:
        return os.fsdecode(name.encode("utf-8", "surrogateescape"))
    except UnicodeEncodeError:
        return printable(name)


def json_bytes(text: str) -> bytes:
    """A JSON text in UTF-8, with lone surrogates escaped."""
    return text.encode("utf-8", "backslashreplace")


def encode_fallback(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that an encoding lacks: the error handler of the output streams."""
    assert isinstance(error, UnicodeEncodeError)
    lacking = error.object[error.start : error.end]
    plain = (
        ASCII_FORMS.get(each, each.encode("ascii", "backslashreplace").decode())
        for each in printable(lacking)
    )
    return "".join(plain), error.end
