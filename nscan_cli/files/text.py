"""Text that can be written and printed everywhere, though names of files are bytes, and need be no text."""

from __future__ import annotations

import os
import re
from pathlib import Path

LONE_SURROGATES = re.compile("[\ud800-\udc7f\udd00-\udfff]")
"""Single surrogates by which Python stands for no byte: a JSON text may have them."""
ASCII_FORMS = {
    "°": " deg", "±": "+-", "×": "x", "·": "*", "→": "->", "←": "<-", "−": "-", "–": "-", "…": "...",
    "≤": "<=", "≥": ">=", "²": "^2", "√": "sqrt ", "Δ": "delta ", "θ": "theta", "φ": "phi", "σ": "sigma",
}  # fmt: skip
"""What is printed where an encoding lacks a character of this package's own messages."""


def printable(text: str) -> str:
    r"""Text with the bytes of names that are no UTF-8 escaped, as in `\xff.log`; other text as it is."""
    if text.isascii():
        return text
    whole = LONE_SURROGATES.sub(lambda found: f"\\u{ord(found[0]):04x}", text)
    return whole.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def name_of_path(path: str) -> str:
    """The name of a file without its folder, as results call it: the same text on every machine."""
    return printable(os.fsencode(Path(path).name).decode("utf-8", "surrogateescape"))


def path_of_name(name: str) -> str:
    """How Python calls the file whose name a document in UTF-8 has, on a machine of any encoding."""
    try:
        return os.fsdecode(name.encode("utf-8", "surrogateescape"))
    except UnicodeEncodeError:
        return printable(name)


def json_bytes(text: str) -> bytes:
    """A JSON text in UTF-8: what is no Unicode is escaped, as JSON can."""
    return text.encode("utf-8", "backslashreplace")


def encode_fallback(error: UnicodeError) -> tuple[str, int]:
    """What is printed for characters that an encoding lacks: the error handler of the output streams."""
    assert isinstance(error, UnicodeEncodeError)
    lacking = error.object[error.start : error.end]
    plain = (
        ASCII_FORMS.get(each, each.encode("ascii", "backslashreplace").decode())
        for each in printable(lacking)
    )
    return "".join(plain), error.end
