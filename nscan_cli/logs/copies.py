"""Records that a log has twice: of files with a common part that were joined, or of one written twice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import TypeVar

from nscan_cli.files.text import counted

Record = TypeVar("Record")
KEY = 40
"""Bytes at an end of a record that tell nearly all apart: they have its time. Shorter records have none."""


def without_copies(records: Sequence[Record], content: Callable[[Record], bytes]) -> tuple[list[Record], str]:
    """The records whose content no earlier one has; and what to say, empty if these are all.

    Records hold their time, so that two alike are one. In a log without times some beside each other may be
    of a robot that stands. There each comes as often as the robot stood long, in a log written twice or more
    times over all come equally often.
    """
    texts = [content(record) for record in records]
    if len({(text[:KEY], text[-KEY:]) for text in texts}) == len(texts):
        return list(records), ""
    seen, kept = set[bytes](), list[Record]()
    times = [len(list(alike)) for _, alike in groupby(texts)]
    may_stand = len(times) == 1 or times[0] == 1 or len(set(times)) > 1
    for row, (record, text) in enumerate(zip(records, texts, strict=True)):
        if text not in seen or (may_stand and text == texts[row - 1]) or len(text) < KEY:
            kept.append(record)
        seen.add(text)
    copies = counted(len(records) - len(kept), "record")
    return kept, "" if len(kept) == len(records) else f"{copies} that repeat earlier ones are left out"
