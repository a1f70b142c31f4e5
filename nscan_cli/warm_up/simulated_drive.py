"""A simulated drive that needs all kernels, so that a run on it compiles them.

It leads through a square corridor with drifting odometry, and has keyframes, joint matches and loops. One
side is bare, so motion along it is uncertain.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nscan_cli.poses import Array

OUTER_WALL, INNER_WALL = 9.0, 6.0
"""Distance of the corridor's walls from its centre, m."""
LAPS, SCAN_SPACING, BEAMS_PER_SCAN = 1.4, 0.3, 181
"""Number of laps, distance between scans (m), and number of beams."""
LASER_REACH, NO_RETURN = 5.0, 81.91
ODOMETRY_DRIFT = 0.004
"""Error of the heading from scan to scan, rad."""


def simulated_carmen_log() -> bytes:
    """The simulated drive as a CARMEN log."""
    import numpy as np

    from nscan_cli.poses import compose, relative

    poses = simulated_poses()
    moves = relative(poses[1:], poses[:-1])
    moves[:, 2] += ODOMETRY_DRIFT
    robot = np.zeros(3)
    angles = np.radians(np.arange(BEAMS_PER_SCAN) - BEAMS_PER_SCAN // 2)
    lines = []
    for row, ranges in enumerate(_simulated_ranges(poses, angles)):
        robot = robot if row == 0 else compose(robot, moves[row - 1])
        pose = " ".join(f"{value:.6f}" for value in robot)
        values = " ".join(f"{value:.2f}" for value in ranges)
        lines.append(f"FLASER {BEAMS_PER_SCAN} {values} {pose} {pose} {0.5 * row:.3f} warm-up 0\n")
    return "".join(lines).encode()


def simulated_poses() -> Array:
    """Poses (S, 3) along the middle of the corridor, turning on the spot at its corners."""
    import numpy as np

    from nscan_cli.poses import wrap

    half = (OUTER_WALL + INNER_WALL) / 2
    side = np.arange(-half, half, SCAN_SPACING)
    sides = int(np.ceil(4 * LAPS))
    poses = []
    for number in range(sides):
        heading = number * np.pi / 2
        cos, sin = np.cos(heading), np.sin(heading)
        along = np.array([(cos * x + sin * half, sin * x - cos * half, heading) for x in side])
        turns = heading + np.radians(np.arange(15, 90, 15))
        x, y = cos * half + sin * half, sin * half - cos * half
        poses += [along, np.array([(x, y, turn) for turn in turns])]
    drive = np.concatenate(poses)
    drive[:, 2] = wrap(drive[:, 2])
    return drive


def _simulated_ranges(poses: Array, angles: Array) -> Array:
    """Ranges (S, B) to the walls of the corridor, m; three of its sides have pillars."""
    import numpy as np

    walls = [*_square_walls(OUTER_WALL), *_square_walls(INNER_WALL)]
    for k in range(-8, 9, 2):
        walls += [((k, OUTER_WALL), (k, OUTER_WALL - 0.4)), ((OUTER_WALL, k), (OUTER_WALL - 0.4, k)),
                  ((-OUTER_WALL, k), (0.5 - OUTER_WALL, k + 0.3))]  # fmt: skip
    directions = poses[:, 2:] + angles
    x, y = np.cos(directions), np.sin(directions)
    nearest = np.full(directions.shape, NO_RETURN)
    for (ax, ay), (bx, by) in walls:
        across = x * (by - ay) - y * (bx - ax)
        along, left = ax - poses[:, :1], ay - poses[:, 1:2]
        with np.errstate(divide="ignore", invalid="ignore"):
            length = (along * (by - ay) - left * (bx - ax)) / across
            place = (along * y - left * x) / across
        meets = (length > 0.05) & (place >= 0) & (place <= 1)
        nearest = np.where(meets, np.minimum(nearest, length), nearest)
    return np.where(nearest > LASER_REACH, NO_RETURN, nearest)


def _square_walls(half: float) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))
