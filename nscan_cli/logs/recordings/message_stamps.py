"""The time stamps of messages: whether they say when the messages were, and which of them were never set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.logs.recordings.decoded_messages import S

LONGEST_START = 1 * S
"""ns; a clock that begins at 0 may take so long to the second message, or as long as to any later one."""


def stamps_set(stamps: Sequence[int]) -> list[int | None]:
    """The stamps (ns) of messages, None where one was never set.

    A clock of a simulation begins at 0: there 0 is a stamp, since the others follow it closely. Of a clock
    that began long ago, such as in 1970, a message with 0 has none.
    """
    others = np.unique([stamp for stamp in stamps if stamp > 0])
    longest = max(LONGEST_START, int(np.diff(others).max(initial=0)))
    begins_at_zero = others.size > 0 and int(others[0]) <= longest
    return [stamp if stamp > 0 or begins_at_zero else None for stamp in stamps]


def is_clock(stamps: Sequence[int | None]) -> bool:
    """Whether stamps tell the order of their messages: most are set, and most of these differ."""
    there = [stamp for stamp in stamps if stamp is not None]
    return 2 * len(there) >= len(stamps) and (len(stamps) == 1 or 2 * len(set(there)) >= len(stamps))
