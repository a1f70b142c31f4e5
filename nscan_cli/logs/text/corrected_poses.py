"""Signs that the poses of a CARMEN log are a mapper's result and no longer odometry."""

from __future__ import annotations

from collections.abc import Container

import numpy as np

from nscan_cli.logs.text.carmen_records import CarmenScans

OWN_HOST = b"nscan-cli"
"""The host of the records that this program writes, whose poses are corrected ones."""


def sign_of_correction(tags: Container[str], scans: CarmenScans) -> str:
    """What gives the log away as corrected (by GMapping's gfs2log and its like), or an empty string.

    Equal poses of laser and robot alone are no sign: many raw logs have them. Together with stamps
    printed by %g, of six significant digits, they are.
    """
    for tag in ("NEFF", "WEIGHT"):
        if tag in tags:
            return f"it has {tag} records"
    if b"pippo" in scans.hosts:
        return "its host is pippo, which GMapping writes"
    if OWN_HOST in scans.hosts:
        return "its host is nscan-cli, which writes corrected poses"
    equal = scans.robot.shape[1] and np.array_equal(scans.laser, scans.robot)
    stamps = [stamp for stamp in scans.stamps if stamp]
    if equal and stamps and all(map(_is_short, stamps)) and any(map(_lost_digits, stamps)):
        return "both poses of each scan are equal, and its times have six digits"
    return ""


def _is_short(stamp: str) -> bool:
    """Whether a stamp is what %g prints."""
    try:
        return f"{float(stamp):g}" == stamp
    except ValueError:
        return False


def _lost_digits(stamp: str) -> bool:
    return "e+" in stamp or len(stamp.replace(".", "").lstrip("-0")) >= 6
