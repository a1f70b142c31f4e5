"""The encoding of text inputs: a byte-order mark is passed over, and what is not UTF-8 is named."""

from __future__ import annotations

from nscan_cli.errors import InputDataError

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""UTF-8's, which editors of Windows write in front."""
WIDE_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")
"""Of UTF-16 and UTF-32; those of big-endian UTF-32 are zeros."""
SNIFFED_BYTES = 64
"""Bytes in which a text of two bytes a character shows: every other one is zero."""


def without_byte_order_mark(data: bytes, name: str) -> bytes:
    """The bytes of an input without the mark; `name` is the file that errors name.

    Raises InputDataError for text in UTF-16 or UTF-32. Bytes that are no text at all stay as they are.
    """
    if data.startswith(WIDE_BYTE_ORDER_MARKS) or _has_wide_characters(data[:SNIFFED_BYTES]):
        raise InputDataError(name, "is text in UTF-16 or UTF-32", "save it as UTF-8")
    return data.removeprefix(BYTE_ORDER_MARK)


def _has_wide_characters(begin: bytes) -> bool:
    """Whether ASCII characters and zeros alternate."""
    halves = begin[::2], begin[1::2]
    return len(begin) >= 8 and any(
        not any(zeros) and all(9 <= byte < 127 for byte in characters)
        for zeros, characters in (halves, halves[::-1])
    )
