"""Priors of a joint match from odometry, from each scan to the next in time (paper, III-E, eq. (14))."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from nscan_cli.matching.joint.joint_energy import Priors, no_priors
from nscan_cli.matching.joint.nscan_match import PriorsAmong
from nscan_cli.matching.motion_model import MotionModel, odometry_prior
from nscan_cli.poses import Array


def odometry_priors(odometry: Array | None, numbers: Sequence[int], model: MotionModel) -> PriorsAmong:
    """Priors from the odometry (n, 3) of the scans `numbers`, from each scan to the next in time; or none."""

    def among(kept: Sequence[int]) -> Priors:
        if odometry is None:
            return no_priors()
        order = sorted(range(len(kept)), key=lambda at: numbers[kept[at]])
        pairs = list(itertools.pairwise(order))
        priors = [odometry_prior(odometry[kept[a]], odometry[kept[b]], model) for a, b in pairs]
        return priors_of(pairs, [prior.mean for prior in priors], [prior.information for prior in priors])

    return among


def priors_of(pairs: list[tuple[int, int]], means: list[Array], information: list[Array]) -> Priors:
    """Priors on the relative poses of m pairs, with means (3,) and information (3, 3) each."""
    if not pairs:
        return no_priors()
    return Priors(np.array(pairs, dtype=np.int64), np.array(means), np.array(information))
