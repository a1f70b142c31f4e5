"""The encoding of text inputs: UTF-8 with or without a byte-order mark; UTF-16 and UTF-32 are refused."""

from __future__ import annotations

from nscan_cli.errors import InputDataError

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""The byte-order mark of UTF-8, which editors on Windows write."""
WIDE_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")
"""Byte-order marks of UTF-16 and UTF-32. That of big-endian UTF-32 begins with zeros, which the sniffing
finds."""
SNIFFED_BYTES = 64
"""Bytes at the beginning in which UTF-16 without a mark is detected: every other one is zero."""


def without_byte_order_mark(data: bytes, name: str) -> bytes:
    """The bytes of an input without byte-order mark; `name` is the file in error messages.

    Raises InputDataError for text in UTF-16 or UTF-32. Bytes that are not text are returned unchanged.
    """
    if data.startswith(WIDE_BYTE_ORDER_MARKS) or _has_wide_characters(data[:SNIFFED_BYTES]):
        raise InputDataError(name, "is text in UTF-16 or UTF-32", "save it as UTF-8")
    return data.removeprefix(BYTE_ORDER_MARK)


def _has_wide_characters(begin: bytes) -> bool:
    halves = begin[::2], begin[1::2]
    return len(begin) >= 8 and any(
        not any(zeros) and all(9 <= byte < 127 for byte in characters)
        for zeros, characters in (halves, halves[::-1])
    )
