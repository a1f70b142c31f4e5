"""First directions that jitter from scan to scan in the file, though the laser looks the same way.

Such a scan seems to be turned by as much, the other way round, against what odometry says.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nscan_cli.calibration.measured_steps import measure_steps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.robust_fit import robust_fit
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import are_known, wrap


def checked_bearings(log: LaserLog, options: FileCheckOptions) -> tuple[LaserLog, list[str]]:
    """The log with one first direction if those in the file differ by mistake, and the messages."""
    jitter = options.jitter
    if log.odometry is None or len(log) < 2:
        return log, []
    usual = float(np.median(log.angle_min))
    by_file = wrap(log.angle_min - usual)
    if float(np.median(np.abs(np.diff(by_file)))) < jitter.min_jitter:
        return log, []
    found = measure_steps(log, telling_steps(log, options.steps), options.steps, turns_alone=True)
    odometry = found.odometry(log.odometry)
    known = are_known(odometry)
    if np.count_nonzero(known) < options.min_steps:
        return log, []
    apart = wrap(found.laser[:, 2] - odometry[:, 2])[known]
    by_jitter = wrap(by_file[found.first] - by_file[found.last])[known]
    fit = robust_fit(by_jitter[:, None, None], apart[:, None])
    share, sigma = float(fit.values[0]), float(np.sqrt(fit.covariance[0, 0]))
    # It is 0 if the laser looks where the file says, and 1 if it does not.
    if share - jitter.sigmas * sigma < 0.5:
        return log, []
    spread = math.degrees(float(np.std(by_file)))
    message = (
        f"the first directions of the scans differ by {spread:.2g}°, but the laser looks the same way: turns "
        f"by scans and by odometry differ by {share:.2f} ± {sigma:.2f} times as much, in "
        f"{counted(len(apart), 'step')}; {math.degrees(usual):.6g}° is used for all; --as-recorded believes "
        "the file"
    )
    return replace(log, angle_min=np.full(len(log), usual)), [message]
