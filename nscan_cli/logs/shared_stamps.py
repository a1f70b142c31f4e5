"""Stamps that several scans share: a clock in whole seconds, or a driver that stamps messages in blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array


@dataclass(frozen=True)
class SharedStampOptions:
    """When scans with one stamp are spread over the time up to the next stamp."""

    min_share: float = 0.1
    """Least share of the scans that have the stamp of the scan before. A larger value spreads fewer."""
    min_stamps: int = 10
    """Least number of different stamps: fewer tell no period. A larger value spreads fewer."""


def spread_stamps(times: Array, options: SharedStampOptions = SharedStampOptions()) -> Array:
    """The times (S,) of scans in file order, s, without shared ones; `times` itself if few are shared.

    Scans with one stamp follow each other from there at even intervals up to the next stamp, at most at the
    usual interval: after a pause none is drawn out. nan are left as they are.
    """
    begins = np.flatnonzero(np.append(True, times[1:] != times[:-1]))
    sizes = np.diff(np.append(begins, len(times)))
    if len(begins) < options.min_stamps or len(times) - len(begins) < options.min_share * len(times):
        return times
    intervals = np.append(np.diff(times[begins]) / sizes[:-1], np.nan)
    forward = intervals[intervals > 0.0]
    if not len(forward):
        return times
    usual = float(np.median(forward))
    intervals = np.where((intervals > 0.0) & (intervals < usual), intervals, usual)
    within = np.arange(len(times)) - np.repeat(begins, sizes)
    spread: Array = times + within * np.repeat(intervals, sizes)
    return spread
