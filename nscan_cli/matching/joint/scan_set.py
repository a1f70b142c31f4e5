"""n scans as the kernels of joint matching take them: concatenated NDTs and points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, numba_inline_kernel
from nscan_cli.ndt.association import association_buffers
from nscan_cli.ndt.energy import ENERGY_NUMBERS, evaluate_energy
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Indices


class ScanSet(NamedTuple):
    """The NDTs and points of n scans, concatenated."""

    grid: Grid
    """The concatenated arrays of all NDTs; row numbers count from the start of their own NDT."""
    points: Array
    """(Σ m, 2) the points of all scans, each in its own frame."""
    starts: Indices
    """(4, n + 1) the first hash slot, row, Gaussian and point of each scan."""
    half: float
    """Side (m) of a lattice cell."""
    usual: Array
    """(n,) the usual s of each scan: the mean s of its points on its own Gaussians, as in a perfect match;
    nan if it is not needed."""


def scan_set(ndts: Sequence[Ndt], points: Sequence[Array], neutral: bool = True) -> ScanSet:
    """Concatenate n NDTs of one cell size and the points (m_i, 2) of n scans.

    Without `neutral`, `usual` is nan, and the neutral energy cannot be computed.
    """
    sizes = [
        (len(ndt.grid.table), ndt.rows, len(ndt.grid.gaussians), len(part))
        for ndt, part in zip(ndts, points, strict=True)
    ]
    starts = np.zeros((4, len(ndts) + 1), dtype=np.int64)
    np.array(sizes).T.cumsum(axis=1, out=starts[:, 1:])
    keys = np.concatenate([ndt.grid.keys[: ndt.rows] for ndt in ndts])
    links = np.concatenate([ndt.grid.links[: ndt.rows] for ndt in ndts])
    # The sums are needed for growing only.
    grid = Grid(
        np.concatenate([ndt.grid.table for ndt in ndts]),
        keys,
        links,
        np.empty((0, 2)),
        np.empty((0, 2, 8)),
        np.concatenate([ndt.grid.gaussians for ndt in ndts]),
        np.empty(0),
    )
    unknown = np.full(len(ndts), np.nan)
    scans = ScanSet(grid, np.concatenate(points, dtype=np.float64), starts, ndts[0].half, unknown)
    return with_usual(scans) if neutral else scans


def with_usual(scans: ScanSet) -> ScanSet:
    """The scans with their `usual` s, which the neutral energy needs."""
    return scans._replace(usual=_usual_s(scans))


@numba_inline_kernel
def scan_grid(scans: ScanSet, i: int) -> Grid:
    """The NDT of scan i."""
    grid, starts = scans.grid, scans.starts
    t0, t1 = starts[0, i], starts[0, i + 1]
    r0, r1 = starts[1, i], starts[1, i + 1]
    g0, g1 = starts[2, i], starts[2, i + 1]
    return Grid(
        grid.table[t0:t1],
        grid.keys[r0:r1],
        grid.links[r0:r1],
        grid.facing,
        grid.sums,
        grid.gaussians[g0:g1],
        grid.settings,
    )


@numba_inline_kernel
def scan_points(scans: ScanSet, i: int) -> Array:
    """The points (m, 2) of scan i in its own frame."""
    return scans.points[scans.starts[3, i] : scans.starts[3, i + 1]]


@kernel
def most_points(scans: ScanSet) -> int:
    """The greatest number of points of a scan."""
    # In kernels, np.diff takes more than a second to compile.
    most = 0
    for i in range(len(scans.usual)):
        most = max(most, scans.starts[3, i + 1] - scans.starts[3, i])
    return most


@kernel
def _usual_s(scans: ScanSet) -> Array:
    """(n,) the mean s of each scan's points on its own Gaussians."""
    means, out, pose = np.empty(len(scans.usual)), np.empty(ENERGY_NUMBERS), np.zeros(3)
    buffers = association_buffers(most_points(scans), 1)
    for i in range(len(means)):
        grid, points = scan_grid(scans, i), scan_points(scans, i)
        evaluate_energy(grid, scans.half, points, pose, 1.0, 0.0, 0.0, 1, buffers, out)
        energy = out[0]
        evaluate_energy(grid, scans.half, points, pose, 1.0, 0.0, 1.0, 1, buffers, out)
        # With a baseline of 1 the energy grows by the number of points on Gaussians.
        means[i] = -energy / max(out[0] - energy, 1.0)
    return means
