"""Sweeps of a laser that come in several messages: they are put together to one scan a sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nscan_cli.logs.recordings.decoded_messages import ScanMessage
from nscan_cli.poses import Indices

REVOLUTION = 2 * math.pi


@dataclass(frozen=True)
class SweepSegmentOptions:
    """When messages are segments of sweeps."""

    step_tolerance: float = 0.5
    """Segments go on where the one before ends, or one step later, to this share of a step. A larger value
    joins more recordings."""
    min_share: float = 0.5
    """Least share of messages that go on where the one before ends. A larger value joins fewer recordings."""
    min_gap_ratio: float = 2.0
    """A sweep begins after the longest pause if that is at least this multiple of the median one. Else it
    begins at the end of the field of view, or with the first message if there is no end. A larger value needs
    longer pauses."""


class TimedScan(NamedTuple):
    """A scan and its times."""

    scan: ScanMessage
    stamp: int | None
    """ns; None if it was never set."""
    log_time: int
    """ns, when it was recorded."""


def joined_sweeps(messages: Sequence[TimedScan]) -> tuple[list[TimedScan], str]:
    """The scans with the segments of each sweep put together, and the message; as they are if none are.

    A scan has the times of the segment in its middle. Beams of segments that are missing are nan.
    """
    scans, options = [message.scan for message in messages], SweepSegmentOptions()
    places, beams_a_sweep = _places(scans, options)
    if not len(places):
        return list(messages), ""
    first = _first_place(messages, places, beams_a_sweep, options.min_gap_ratio)
    places = (places - first) % beams_a_sweep
    sweeps: list[list[int]] = []
    for row, place in enumerate(places.tolist()):
        if sweeps and place > places[sweeps[-1][-1]]:
            sweeps[-1].append(row)
        else:
            sweeps.append([row])
    beams = max(int(places[row]) + len(scans[row].ranges) for row in range(len(scans)))
    begin = next(scans[sweep[0]].angle_min for sweep in sweeps if places[sweep[0]] == places.min())
    joined = [_joined([messages[row] for row in sweep], places[sweep], begin, beams) for sweep in sweeps]
    width = math.degrees(abs(scans[0].angle_increment) * len(scans[0].ranges))
    several = max(map(len, sweeps))
    said = (
        f"a turn of the laser comes in {several} messages of {width:.0f}°: they are put together to one "
        "scan; --as-recorded reads each as a scan"
    )
    return joined, said


def _places(scans: Sequence[ScanMessage], options: SweepSegmentOptions) -> tuple[Indices, int]:
    """The places in a sweep at which messages begin, in beams from the first one; and the beams of a sweep.

    Empty unless messages mostly go on where the one before ends.
    """
    none, step = np.zeros(0, dtype=np.int64), scans[0].angle_increment
    firsts = np.array([scan.angle_min for scan in scans])
    sizes = np.array([len(scan.ranges) for scan in scans])
    steps = np.array([scan.angle_increment for scan in scans])
    if np.abs(steps / step - 1).max() > options.step_tolerance / sizes.max() or sizes.max() < 2:
        return none, 0
    beams_a_sweep = round(REVOLUTION / abs(step))
    # One message of a whole revolution goes on where it began itself.
    if sizes.max() > beams_a_sweep // 2 + 1 or len(scans) < 2:
        return none, 0
    offsets = (firsts - firsts[0]) / step
    off = (
        np.mod(offsets[1:] - offsets[:-1] - sizes[:-1] + beams_a_sweep / 2, REVOLUTION / abs(step))
        - beams_a_sweep / 2
    )
    goes_on = np.abs(off) <= 1 + options.step_tolerance
    if goes_on.mean() < options.min_share:
        return none, 0
    return np.mod(np.rint(offsets).astype(np.int64), beams_a_sweep), beams_a_sweep


def _first_place(
    messages: Sequence[TimedScan], places: Indices, beams_a_sweep: int, min_gap_ratio: float
) -> int:
    """The place at which sweeps begin: after a pause, at the end of the field of view, or anywhere."""
    stamps = [message.log_time if message.stamp is None else message.stamp for message in messages]
    pauses = np.diff(stamps)
    known, rows = np.unique(places, return_index=True)
    before = [pauses[places[1:] == place] for place in known]
    usual = [float(np.median(some)) if len(some) else 0.0 for some in before]
    longest = int(np.argmax(usual))
    if usual[longest] > min_gap_ratio * float(np.median(usual)):
        return int(known[longest])
    if sum(len(messages[row].scan.ranges) for row in rows.tolist()) >= beams_a_sweep:
        return int(places[0])
    firsts = np.array([message.scan.angle_min for message in messages])
    return int(places[np.argmin(firsts * np.sign(messages[0].scan.angle_increment))])


def _joined(sweep: Sequence[TimedScan], places: Indices, begin: float, beams: int) -> TimedScan:
    """One scan of the segments that begin at `places`, from the bearing `begin` (rad) on."""
    ranges = np.full(beams, np.nan, dtype=np.float32)
    for message, place in zip(sweep, places.tolist(), strict=True):
        ranges[place : place + len(message.scan.ranges)] = message.scan.ranges
    middle = sweep[len(sweep) // 2]
    end = begin + middle.scan.angle_increment * (beams - 1)
    scan = middle.scan._replace(
        ranges=ranges, angle_min=begin, angle_max=end, time_increment=0.0, scan_time=0.0
    )
    return middle._replace(scan=scan)
