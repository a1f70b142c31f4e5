"""The tracked path with the uncertainty of slips that tracking does not notice (paper, V: large loops)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.graph.model import Pairwise
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.small_matrices import inverted
from nscan_cli.poses import Array


class TrackedPath:
    """The relations from each keyframe to the next. Slips add `drift` (m/√m) and `drift_angle` (rad/√m)."""

    def __init__(self, drift: float, drift_angle: float) -> None:
        self.relations: list[Pairwise] = []
        """`relations[k]` leads from keyframe k to k + 1."""
        self._variances = drift**2, drift**2, drift_angle**2
        self._covariances = np.empty((16, 3, 3))

    def __len__(self) -> int:
        return len(self.relations)

    @property
    def covariances(self) -> Array:
        """(len, 3, 3) covariances of the relations' measurements."""
        return self._covariances[: len(self.relations)]

    def extend(self, relation: Pairwise, length: float, slip: tuple[float, float] = (0.0, 0.0)) -> None:
        """Add the next relation, over a path of this `length` (m).

        By `slip` it may have slipped besides: variances of a coordinate (m²) and of its angle (rad²).
        """
        along = self._variances[0] * length + slip[0]
        slips = along, along, self._variances[2] * length + slip[1]
        covariance, information = _with_slips(relation.information, slips)
        end = len(self.relations)
        if end == len(self._covariances):
            self._covariances = np.concatenate([self._covariances, np.empty((end, 3, 3))])
        self._covariances[end] = covariance
        self.relations.append(replace(relation, information=information))


@kernel
def _with_slips(information: Array, slips: tuple[float, float, float]) -> tuple[Array, Array]:
    """Covariance and information (3, 3) with these variances added."""
    covariance = inverted(information)
    for a in range(3):
        covariance[a, a] += slips[a]
    return covariance, inverted(covariance)
