"""What goes wrong with the odometry of a log that was recorded without trouble.

Every function takes a log with odometry and gives another with the same scans; true poses stay true. Rows are
positions in the log; `rows` is any slice or array of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose, relative, wrap
from tests.logs.excerpts import Rows


def reset(log: LaserLog, at: int) -> LaserLog:
    """The odometry begins at (0, 0, 0) again with row `at`."""
    odometry = _odometry(log).copy()
    odometry[at:] = relative(odometry[at:], odometry[at])
    return replace(log, odometry=odometry)


def missing(log: LaserLog, rows: Rows) -> LaserLog:
    """The odometry says nothing at `rows`, as where a node had died or a topic was not recorded."""
    odometry = _odometry(log).copy()
    odometry[rows] = np.nan
    return replace(log, odometry=odometry)


def held(log: LaserLog, rows: Rows, catches_up: bool) -> LaserLog:
    """The odometry does not move in `rows`; then it jumps to where it would be, or it has lost the way."""
    some, odometry = np.arange(len(log))[rows], _odometry(log).copy()
    first, last = int(some[0]), int(some[-1])
    if not catches_up:
        odometry[last + 1 :] = compose(odometry[first], relative(odometry[last + 1 :], odometry[last]))
    odometry[some] = odometry[first]
    return replace(log, odometry=odometry)


def partly_held(log: LaserLog, rows: Rows, columns: slice) -> LaserLog:
    """Some of x, y and heading do not move in `rows`, and have lost the way: encoders or a gyroscope fail."""
    some, odometry = np.arange(len(log))[rows], _odometry(log).copy()
    first, last = int(some[0]), int(some[-1])
    odometry[last + 1 :, columns] += odometry[first, columns] - odometry[last, columns]
    odometry[some, columns] = odometry[first, columns]
    return replace(log, odometry=odometry)


def repeated(log: LaserLog, times: int) -> LaserLog:
    """The odometry comes with every so many-th scan, and is repeated until then."""
    return replace(log, odometry=_odometry(log)[np.arange(len(log)) // times * times])


def scaled(log: LaserLog, factor: float) -> LaserLog:
    """The positions by odometry in another unit."""
    return replace(log, odometry=_odometry(log) * (factor, factor, 1.0))


def scaled_in(log: LaserLog, factor: float, rows: Rows) -> LaserLog:
    """The steps that end in `rows` are in another unit."""
    steps, some = relative(_odometry(log)[1:], _odometry(log)[:-1]), np.zeros(len(log), dtype=bool)
    some[rows] = True
    steps[some[1:], :2] *= factor
    return replace(log, odometry=_summed(_odometry(log)[0], steps))


def x_reversed(log: LaserLog) -> LaserLog:
    """The odometry counts x the wrong way; its headings are right."""
    return replace(log, odometry=_odometry(log) * (-1.0, 1.0, 1.0))


def behind(log: LaserLog) -> LaserLog:
    """The odometry counts forward as backward, in every step; its turns are right."""
    steps = relative(_odometry(log)[1:], _odometry(log)[:-1]) * (-1.0, -1.0, 1.0)
    return replace(log, odometry=_summed(_odometry(log)[0], steps))


def backward(log: LaserLog) -> LaserLog:
    """Both wheels count backward: the odometry drives and turns the other way."""
    return replace(log, odometry=_odometry(log) * (-1.0, 1.0, -1.0), odometry_path=None)


def unsigned(log: LaserLog) -> LaserLog:
    """It counts reversing as driving forward; its turns are right."""
    steps = relative(_odometry(log)[1:], _odometry(log)[:-1])
    steps[:, :2] *= np.where(steps[:, :1] < 0.0, -1.0, 1.0)
    return replace(log, odometry=_summed(_odometry(log)[0], steps), odometry_path=None)


def late(log: LaserLog, seconds: float) -> LaserLog:
    """The clock of the odometry is ahead of the laser's by so much: it tells what was before."""
    at, odometry = log.times + seconds, _odometry(log)
    turned = np.unwrap(odometry[:, 2])
    columns = [np.interp(log.times, at, column) for column in (*odometry[:, :2].T, turned)]
    return replace(log, odometry=np.stack([*columns[:2], wrap(columns[2])], axis=1))


def turning(log: LaserLog, factor: float) -> LaserLog:
    """The odometry multiplies each turn."""
    steps = relative(_odometry(log)[1:], _odometry(log)[:-1]) * (1.0, 1.0, factor)
    return replace(log, odometry=_summed(_odometry(log)[0], steps))


def heading_elsewhere(log: LaserLog, turn: float) -> LaserLog:
    """The headings by odometry are too far to the left by a turn (rad); its positions are right."""
    odometry = _odometry(log).copy()
    odometry[:, 2] = wrap(odometry[:, 2] + turn)
    return replace(log, odometry=odometry)


def jump(log: LaserLog, at: int, jump: tuple[float, float, float]) -> LaserLog:
    """From row `at` on the odometry is off by a pose, in its own frame."""
    odometry = _odometry(log).copy()
    odometry[at:] = compose(np.array(jump), odometry[at:])
    return replace(log, odometry=odometry)


def spike(log: LaserLog, at: int, value: tuple[float, float, float]) -> LaserLog:
    """A single wrong value in row `at`."""
    odometry = _odometry(log).copy()
    odometry[at] = value
    return replace(log, odometry=odometry)


def noisy(log: LaserLog, distance: float, turn: float, times: int, seconds: float, seed: int = 1) -> LaserLog:
    """White noise, of standard deviations in m and rad, for so many seconds, so many times."""
    odometry, rng = _odometry(log).copy(), np.random.default_rng(seed)
    since = (log.times - log.times[0]) / (log.times[-1] - log.times[0]) * times % 1.0
    length = float(log.times[-1] - log.times[0]) / times
    some = (since >= 0.5) & ((since - 0.5) * length < seconds)
    odometry[some] += rng.normal(size=(np.count_nonzero(some), 3)) * (distance, distance, turn)
    odometry[:, 2] = wrap(odometry[:, 2])
    return replace(log, odometry=odometry, odometry_path=None)


def astray(log: LaserLog, least: float, most: float, count: int, seed: int = 1) -> LaserLog:
    """So many single poses, evenly over the log, are off by a distance between two (m), in any direction."""
    odometry, rng = _odometry(log).copy(), np.random.default_rng(seed)
    rows = np.linspace(0, len(log) - 1, count + 2).astype(np.int64)[1:-1]
    away, towards = rng.uniform(least, most, count), rng.uniform(-np.pi, np.pi, count)
    odometry[rows, 0] += away * np.cos(towards)
    odometry[rows, 1] += away * np.sin(towards)
    return replace(log, odometry=odometry, odometry_path=None)


def zeros(log: LaserLog, every: int) -> LaserLog:
    """One value in so many is all zeros."""
    odometry = _odometry(log).copy()
    odometry[::every] = 0.0
    return replace(log, odometry=odometry)


def alternating(log: LaserLog, frame: Array) -> LaserLog:
    """Every second value is of another node, whose frame is at (3,) in that of the first."""
    odometry = _odometry(log).copy()
    odometry[1::2] = compose(frame, odometry[1::2])
    return replace(log, odometry=odometry)


def wrapped(log: LaserLog, limit: float) -> LaserLog:
    """Coordinates kept in [−limit, limit), as a counter of too few bits does."""
    odometry = _odometry(log).copy()
    odometry[:, :2] = np.mod(odometry[:, :2] + limit, 2 * limit) - limit
    return replace(log, odometry=odometry)


def jumping(log: LaserLog, every: int, step: Array) -> LaserLog:
    """The odometry goes by `step` (3,) farther in every so many-th of its steps, as where a node is busy."""
    odometry = _odometry(log)
    steps = relative(odometry[1:], odometry[:-1])
    steps[every - 1 :: every] += step
    return replace(log, odometry=_summed(odometry[0], steps))


def _summed(first: Array, steps: Array) -> Array:
    """(n + 1, 3) the poses to which steps (n, 3) lead from the first."""
    poses = [first]
    for step in steps:
        poses.append(compose(poses[-1], step))
    return np.array(poses)


def _odometry(log: LaserLog) -> Array:
    assert log.odometry is not None
    return log.odometry
