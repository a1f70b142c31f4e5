"""Signs that the poses of a CARMEN log are the result of a mapper, not odometry."""

from __future__ import annotations

from collections.abc import Container

import numpy as np

from nscan_cli.logs.text.carmen_records import CarmenScans

OWN_HOST = b"nscan-cli"
"""The host in the records that this program writes. Their poses are corrected."""
SHORT_DIGITS = 6
"""Number of significant digits that %g prints."""


def sign_of_correction(tags: Container[str], scans: CarmenScans) -> str:
    """The sign that a mapper (such as GMapping's gfs2log) wrote the poses; empty if there is none.

    Equal poses of laser and robot alone are no sign, as many raw logs have them. Together with stamps of six
    significant digits, as %g prints, they are.
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
    if equal and stamps and all(map(_is_six_digit_stamp, stamps)) and any(map(_lost_digits, stamps)):
        return "both poses of each scan are equal, and its times have six digits"
    return ""


def _is_six_digit_stamp(stamp: str) -> bool:
    try:
        return f"{float(stamp):g}" == stamp
    except ValueError:
        return False


def _lost_digits(stamp: str) -> bool:
    return "e+" in stamp or len(stamp.replace(".", "").lstrip("-0")) >= SHORT_DIGITS
