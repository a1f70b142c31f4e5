"""Points as a scan has them: along walls, in clusters, and a few anywhere."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array


def room(seed: int) -> Array:
    """(150, 2) points of noisy walls, a cluster and outliers, on both sides of 0."""
    rng = np.random.default_rng(seed)
    along = rng.uniform(-4, 4, 100)
    walls = np.concatenate(
        [
            np.stack([along[:50], np.full(50, 2.3)], axis=1),
            np.stack([np.full(50, -3.1), along[50:]], axis=1),
        ]
    )
    walls += rng.normal(0, 0.03, walls.shape)
    cluster = rng.normal([1.2, -1.7], 0.25, (40, 2))
    return np.concatenate([walls, cluster, rng.uniform(-5, 5, (10, 2))])
