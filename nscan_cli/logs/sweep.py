"""How long a laser takes for its sweep by its file, and which such times are plausible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.logs.scan_order import usual_period
from nscan_cli.poses import Array, Indices

BEFORE_STAMP = {"first": 0.0, "middle": 0.5, "last": 1.0}
"""Share of the time from the first beam to the last that has passed at a stamp of each kind."""


@dataclass(frozen=True)
class SweepOptions:
    """Which times of a sweep can be."""

    shortest: float = 1e-3
    """A laser whose sweep takes less time than this sees at once, s. A larger value leaves more lasers
    uncorrected."""
    least_turn_time: float = 0.012
    """No laser turns in less time than this, s: those in use turn up to 80 times a second. A larger value
    believes fewer files."""
    jitter: float = 1.1
    """Largest time from the first beam to the last, in periods of the scans: drivers measure it loosely. A
    larger value believes more files."""
    varying: float = 2.0
    """The time of a single scan is not used if it differs from the median by more than this factor. A larger
    value follows lasers whose speed changes more, and more errors of drivers."""


@dataclass(frozen=True)
class RecordedSweep:
    """What the messages of S scans say, in file order."""

    increment: Array
    """(S,) time from beam to beam, s; 0 or nan where they do not say."""
    scan_time: Array
    """(S,) time from scan to scan, s; 0 or nan where they do not say."""

    def of(self, rows: Indices) -> RecordedSweep:
        """The times that the messages of some scans say."""
        return RecordedSweep(self.increment[rows], self.scan_time[rows])


@dataclass(frozen=True)
class Sweep:
    """How long the sweeps of S scans take, in order of time."""

    seconds: Array
    """(S,) time of 360°; negative where the readings are in the reverse order of time; 0: seen at once."""
    origin: str
    """The origin of the times, for `info`; empty if the log has nothing about them."""
    said: tuple[str, ...] = ()
    """A sentence for the user if the file contradicts itself."""


def sweep_of_file(
    told: RecordedSweep | None, increments: Array, beams: Indices, times: Array, as_recorded: bool = False
) -> Sweep:
    """The likeliest times of the sweeps, from what S scans say of them.

    `increments` (S,) rad and `beams` (S,) are the angles between beams and their numbers, `times` (S,) those
    of the scans, s; all are in order of time. A time from beam to beam is implausible if the scan would last
    longer than the time to the next, or the sweep would be faster than any laser. It is then replaced by the
    time between scans, unless `as_recorded`. A file without times of beams may be of a laser that sees at
    once.
    """
    options = SweepOptions()
    none = np.zeros(len(times))
    if told is None:
        return Sweep(none, "")
    some = np.isfinite(told.increment) & (told.increment != 0.0)
    if not some.any():
        return Sweep(none, "")
    usual = float(np.median(told.increment[some]))
    per_beam = np.where(some, told.increment, usual)
    ratio = per_beam / usual
    per_beam[(ratio > options.varying) | (ratio < 1.0 / options.varying)] = usual
    sweeps = per_beam * 2 * np.pi / np.abs(increments)
    usual_sweep = float(np.median(np.abs(sweeps)))
    if usual_sweep < options.shortest:
        return Sweep(none, f"time_increment of the messages: a turn takes {usual_sweep * 1e3:.2g} ms")
    period = usual_period(times)
    lasts = float(np.median(np.abs(per_beam) * np.maximum(beams - 1, 1)))
    too_long = period > 0.0 and lasts > options.jitter * period
    if as_recorded or (usual_sweep >= options.least_turn_time and not too_long):
        return Sweep(sweeps, "time_increment of the messages")
    scan_time = told.scan_time[np.isfinite(told.scan_time) & (told.scan_time > 0.0)]
    likely = float(np.median(scan_time)) if len(scan_time) else period
    origin = "scan_time" if len(scan_time) else "the time between scans"
    if period > 0.0 and likely > options.jitter * period:
        likely, origin = period, "the time between scans"
    if likely < options.least_turn_time:
        return Sweep(none, "time_increment of the messages cannot be")
    why = (
        f"a scan would take {lasts:.3g} s, but the next comes after {period:.3g} s"
        if too_long
        else f"a turn would take {usual_sweep:.2g} s, and no laser turns so fast"
    )
    said = (
        f"time_increment of the messages is likely wrong: {why}; {origin} is used, a turn of {likely:.3g} s, "
        "as by --sweep; --as-recorded uses it as it is"
    )
    return Sweep(np.full(len(times), np.copysign(likely, usual)), origin, (said,))


def beam_times(seconds: Array, increments: Array, beams: Indices, stamp: str) -> BeamTimes | None:
    """The times of the beams of S scans; None if all are seen at once.

    `seconds` (S,) are the times of a sweep, as in Sweep, `increments` (S,) the angles between beams, rad.
    """
    if not seconds.any():
        return None
    step = seconds * np.abs(increments) / (2 * np.pi)
    lasts = step * np.maximum(beams - 1, 0)
    # What the stamp is set by is the course of time, whatever the order of the readings.
    began = np.where(step < 0.0, -lasts, 0.0)
    return BeamTimes(began - BEFORE_STAMP[stamp] * np.abs(lasts), step)
