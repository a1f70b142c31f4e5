"""The time stamps of messages: which of them were ever set, and whether they order the messages."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.logs.recordings.decoded_messages import S
from nscan_cli.logs.scan_order import ScanOrderOptions
from nscan_cli.logs.stamp_unit import stamp_unit


def valid_stamps(stamps: Sequence[int], options: ScanOrderOptions = ScanOrderOptions()) -> list[int | None]:
    """The stamps (ns) of messages; None for a 0 that was never set.

    A simulated clock begins at 0, and the next stamps follow closely: there 0 is valid. Where the other
    stamps are far from 0, such as those since 1970, it was never set.
    """
    others = np.unique([stamp for stamp in stamps if stamp > 0])
    longest = max(int(options.longest_first_step * S), int(np.diff(others).max(initial=0)))
    begins_at_zero = others.size > 0 and int(others[0]) <= longest
    return [stamp if stamp > 0 or begins_at_zero else None for stamp in stamps]


def order_messages(stamps: Sequence[int | None]) -> bool:
    """Whether stamps give the order of their messages: at least half are set, and half of these differ."""
    valid = [stamp for stamp in stamps if stamp is not None]
    return 2 * len(valid) >= len(stamps) and (len(stamps) == 1 or 2 * len(set(valid)) >= len(stamps))


def are_in_seconds(stamps: Sequence[int | None]) -> bool:
    """Whether stamps, given in ns, are what they say: other units are told by their period."""
    return stamp_unit(np.array([stamp for stamp in stamps if stamp is not None]) / S) is None
