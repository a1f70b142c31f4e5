"""The sweep of the laser of a drive that is calibrated: its time, and the beam that scans are stamped at."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.estimate import Estimate, estimate
from nscan_cli.calibration.file_sweep import first_to_last, stamp_place, usual_sweep_time, with_sweep_times
from nscan_cli.calibration.options import CalibrationOptions
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.sweep_time import sweep_time
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array

FEW_TURNS = "too few scans are taken in turns"


@dataclass(frozen=True)
class CalibratedSweep:
    """The sweep of a laser by the scans of a log."""

    log: LaserLog
    """The log with the times of beams of that sweep."""
    estimate: Estimate
    """The time of a sweep, s; negative where the readings are in the reverse order of time."""
    pairs: int
    """Number of pairs of scans that the estimate rests on."""
    seconds: float
    """The time that is used: the file's unless the scans contradict it."""
    options: CalibrationOptions
    _motion: ScanMotion

    def corrected(self, row: int) -> Array | None:
        """Points (m, 2) of a scan from where the laser is at its middle beam; None in doubt."""
        return self._motion.corrected(row, self.seconds)

    def stamp(self, recorded: str, offset: Estimate) -> str | None:
        """The beam that scans are stamped at, by the offset of odometry's clock (s) from that of the scans.

        The scans are read as if stamped at the `recorded` one. None where nothing tells it: the clocks may
        differ by any time.
        """
        apart = 0.5 * first_to_last(self.log)
        if not self.options.sweep.sigmas * offset.sigma < apart:
            return None
        return stamp_place(self.log, recorded, offset.value, self.options.sweep)


def calibrated_sweep(log: LaserLog, options: CalibrationOptions) -> CalibratedSweep:
    """The sweep of a log's laser, measured by its scans."""
    told, period = usual_sweep_time(log), float(np.median(np.diff(log.times)))
    steps = replace(options.steps, max_beams=options.sweep.time.max_beams)
    motion = ScanMotion.of_log(log, steps, options.sweep)
    found = sweep_time(motion, max(abs(told), period), options.sweep)
    seconds = found.believed(told, period, options.sweep.sigmas)
    if seconds and found.sigma > options.max_sweep_sigma * abs(found.seconds):
        seconds = told
    if seconds != told:
        log = with_sweep_times(log, np.full(len(log), seconds), log.reading.stamp)
    by_scans = estimate(found.seconds, found.sigma, told, FEW_TURNS)
    return CalibratedSweep(log, by_scans, found.pairs, seconds, options, motion)
