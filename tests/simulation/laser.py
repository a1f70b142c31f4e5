"""A 2D laser scanner: rays cast into a world, and what an imperfect sensor makes of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array, compose, wrap
from tests.simulation.world import World

CHUNK = 16
"""Scans cast at once; more take more memory and no less time."""


@dataclass(frozen=True)
class Laser:
    """A scanner and its errors; `exact()` has none."""

    beams: int = 180
    angle_min: float = -np.pi / 2
    angle_increment: float = np.pi / 180
    max_range: float = 30.0
    """m; what is farther gives no return."""
    no_return: float = 81.91
    """The reading (m) of a beam without return."""
    noise: float = 0.015
    """Standard deviation (m) of a range."""
    resolution: float = 0.01
    """m; ranges are rounded to it; 0: not rounded."""
    dropout: float = 0.002
    """Probability that a beam gives no return for no reason."""
    grazing: float = np.radians(84)
    """Angle of incidence (rad) from which on half of the beams are lost."""
    mount: tuple[float, float, float] = (0.10, 0.0, 0.0)
    """Pose on the robot."""

    def angles(self) -> Array:
        """(B,) directions of the beams in the laser's frame, rad."""
        return np.arange(self.beams, dtype=np.float64) * self.angle_increment + self.angle_min


def exact(laser: Laser) -> Laser:
    """The same scanner without noise, rounding and dropouts."""
    return Laser(
        laser.beams, laser.angle_min, laser.angle_increment, laser.max_range, laser.no_return,
        noise=0.0, resolution=0.0, dropout=0.0, grazing=np.pi, mount=laser.mount,
    )  # fmt: skip


def cast(world: World, robot: Array, laser: Laser) -> tuple[Array, Array, Array]:
    """True ranges (S, B) from robot poses (S, 3), inf where nothing is hit, whatever the maximum range.

    Also the angle of incidence (S, B; rad, 0 is head-on) and the absorption (S, B) of what was hit.
    """
    origins = compose(robot, np.array(laser.mount))
    parts = [_cast(world, origins[at : at + CHUNK], laser) for at in range(0, len(origins), CHUNK)]
    ranges, incidence, absorption = (np.concatenate(column) for column in zip(*parts, strict=True))
    return ranges, incidence, absorption


def _cast(world: World, origins: Array, laser: Laser) -> tuple[Array, Array, Array]:
    """Each obstacle is met only with the beams between the bearings of its ends."""
    shape = (len(origins), laser.beams)
    ranges = np.full(shape, np.inf).ravel()
    incidence, absorption = np.zeros_like(ranges), np.zeros_like(ranges)
    directions = (origins[:, 2:] + laser.angles()).ravel()

    ax, ay, bx, by = (
        column[None] - origins[:, at : at + 1]
        for column, at in zip(world.segments.T, (0, 1, 0, 1), strict=True)
    )
    first = np.arctan2(ay, ax)
    turn = wrap(np.arctan2(by, bx) - first)
    scan, obstacle, beam = _pairs(first + np.minimum(turn, 0), np.abs(turn), origins, laser)
    dx, dy = np.cos(directions[beam]), np.sin(directions[beam])
    ax, ay, ex, ey = (
        ax[scan, obstacle],
        ay[scan, obstacle],
        (bx - ax)[scan, obstacle],
        (by - ay)[scan, obstacle],
    )
    # The beam o + t d meets the line a + s e where t = (a - o) × e / d × e.
    with np.errstate(divide="ignore", invalid="ignore"):
        across = dx * ey - dy * ex
        distance = (ax * ey - ay * ex) / across
    distance[~(distance > 0)] = np.inf
    np.minimum.at(ranges, beam, distance)
    hit = (distance == ranges[beam]) & np.isfinite(distance)
    incidence[beam[hit]] = np.arccos(np.clip(np.abs(across[hit]) / np.hypot(ex[hit], ey[hit]), 0, 1))
    absorption[beam[hit]] = world.absorption[obstacle[hit]]

    cx, cy = (world.circles[None, :, at] - origins[:, at : at + 1] for at in (0, 1))
    radius = world.circles[:, 2]
    half = np.arcsin(np.clip(radius / np.hypot(cx, cy), 0, 1))
    scan, obstacle, beam = _pairs(np.arctan2(cy, cx) - half, 2 * half, origins, laser)
    dx, dy, cx, cy = (
        np.cos(directions[beam]),
        np.sin(directions[beam]),
        cx[scan, obstacle],
        cy[scan, obstacle],
    )
    half_chord = np.sqrt(np.maximum(radius[obstacle] ** 2 - (cx * dy - cy * dx) ** 2, 0))
    distance = cx * dx + cy * dy - half_chord
    distance[~(distance > 0)] = np.inf
    np.minimum.at(ranges, beam, distance)
    hit = (distance == ranges[beam]) & np.isfinite(distance)
    incidence[beam[hit]] = absorption[beam[hit]] = 0.0
    return ranges.reshape(shape), incidence.reshape(shape), absorption.reshape(shape)


def _pairs(
    start: Array, width: Array, origins: Array, laser: Laser
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Scan, obstacle and beam (counted through all scans) wherever a beam points between two bearings.

    start, width (S, N): the first bearing of each obstacle and the angle from there on, rad.
    """
    from_first = np.mod(start - origins[:, 2:] - laser.angle_min, 2 * np.pi)
    # Bearings are cyclic: an obstacle may begin behind the last beam and reach over the first.
    begins = np.stack([from_first, from_first - 2 * np.pi])
    low = np.ceil(begins / laser.angle_increment - 1e-9).clip(0, laser.beams).astype(np.intp)
    ends = (begins + width) / laser.angle_increment + 1e-9
    high = (np.floor(ends) + 1).clip(0, laser.beams).astype(np.intp)
    counts = np.maximum(high - low, 0).ravel()
    _, scan, obstacle = (np.repeat(index.ravel(), counts) for index in np.indices(low.shape))
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return scan, obstacle, scan * laser.beams + np.repeat(low.ravel(), counts) + within


def measure(world: World, robot: Array, laser: Laser, rng: np.random.Generator) -> Array:
    """Readings (S, B) of the laser on a robot at poses (S, 3)."""
    return with_errors(*cast(world, robot, laser), laser, rng)


def with_errors(
    ranges: Array, incidence: Array, absorption: Array, laser: Laser, rng: np.random.Generator
) -> Array:
    """Readings (S, B) that an imperfect laser makes of what `cast` gives."""
    chance = rng.random(ranges.shape)
    lost = 1 - (1 - laser.dropout) * (1 - absorption) * np.where(incidence > laser.grazing, 0.5, 1.0)
    noisy = ranges + laser.noise * rng.standard_normal(ranges.shape)
    if laser.resolution:
        noisy = np.round(noisy / laser.resolution) * laser.resolution
    return np.where((ranges > laser.max_range) | (chance < lost), laser.no_return, noisy)
