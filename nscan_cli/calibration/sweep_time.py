"""How long a sweep of the laser takes, by its scans: a value with its standard deviation.

Pairs of scans that were taken while the robot turned differently are matched with many assumed times. Their
energies have a minimum at the true one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.parabola import parabola_minimum
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.sweep_evidence import turning_pairs
from nscan_cli.calibration.sweep_options import SweepCheckOptions, SweepTimeOptions
from nscan_cli.poses import Array


@dataclass(frozen=True)
class SweepTime:
    """The time of a sweep that makes scans sharpest."""

    seconds: float
    """Negative if the readings are in the reverse order of time, nearly 0 if all are seen at once."""
    sigma: float
    """Standard deviation, s; inf where the robot hardly turns, or the scans do not tell."""
    pairs: int
    """Pairs of scans that it rests on."""

    def believed(self, told: float, period: float, sigmas: float) -> float:
        """The time to use if the file tells one, 0 for none, and scans follow each other in a period, all s.

        It is the file's time, unless the scans contradict it by enough standard deviations. No sweep takes
        longer than the time from scan to scan, or than the file says. Lasers mostly sweep once a scan, or
        twice where every second one is missing.
        """
        longest = max(period, abs(told))
        value, bound = float(np.clip(self.seconds, -longest, longest)), sigmas * self.sigma
        for known in (told, -told, 0.0, np.copysign(period, value), np.copysign(0.5 * period, value)):
            if abs(value - known) <= bound:
                return float(known)
        return value


def sweep_time(motion: ScanMotion, longest: float, options: SweepCheckOptions) -> SweepTime:
    """The time of a sweep of the laser of a log, of about `longest` (s) at most, in both directions.

    The standard deviation is that of the jackknife over the pairs (B. Efron, "The Jackknife, the Bootstrap
    and Other Resampling Plans", 1982), with what uneven turns of the robot add.
    """
    time = options.time
    count = round(time.reach / time.step)
    sweeps = time.step * longest * np.arange(-count, count + 1, dtype=np.float64)
    # Pairs of scans that are spread over the log tell more than as many of the same turns.
    energies, uneven = _energies(motion, longest, sweeps, replace(options, scans_beside=0))
    if len(energies) < time.min_steady:
        energies, uneven = _energies(motion, longest, sweeps, options)
    pairs = len(energies)
    if pairs < options.min_pairs:
        return SweepTime(0.0, np.inf, pairs)
    sweep = _sharpest(sweeps, energies, time)
    if abs(sweep) >= sweeps[-2]:
        # Beyond what was tried.
        return SweepTime(0.0, np.inf, pairs)
    without_one = np.array([
        _sharpest(sweeps, np.delete(energies, pair, axis=0), time) for pair in range(pairs)
    ])  # fmt: skip
    sigma = np.sqrt((pairs - 1) * without_one.var())
    share = time.unsteadiness * max(uneven / time.max_change, 1.0)
    return SweepTime(sweep, float(np.hypot(sigma, share * sweep)), pairs)


def _energies(
    motion: ScanMotion, longest: float, sweeps: Array, options: SweepCheckOptions
) -> tuple[Array, float]:
    """(P, T) energies of P pairs for times of a sweep (T,), of scans in steady turns if there are enough.

    Also returns the mean share by which turns change within a pair.
    """
    time = options.time
    steady, uneven = list[tuple[Array, float]](), list[tuple[Array, float]]()
    for one, other in turning_pairs(motion, longest, options, time.scans, time.most_rows):
        change = max(motion.unsteadiness(one, time), motion.unsteadiness(other, time))
        is_steady = change <= time.max_change
        if not is_steady and len(uneven) == time.pairs:
            continue
        energies = motion.energies(one, other, sweeps.tolist())
        if energies is not None:
            (steady if is_steady else uneven).append((energies, change))
        if len(steady) == time.pairs:
            break
    if len(steady) < time.min_steady:
        steady += uneven[: time.pairs - len(steady)]
    changes = [change for _, change in steady]
    found = np.array([energies for energies, _ in steady]).reshape(-1, len(sweeps))
    return found, float(np.mean(changes)) if changes else 0.0


def _sharpest(sweeps: Array, energies: Array, options: SweepTimeOptions) -> float:
    """The time with the least energy (P, T) of all pairs, by a parabola through the times (T,) beside it."""
    above = energies - energies.min(axis=1, keepdims=True)
    most = options.cap * float(np.median(above.max(axis=1)))
    means: Array = np.minimum(above, most).mean(axis=0)
    best, step = float(sweeps[np.argmin(means)]), float(sweeps[1] - sweeps[0])
    return float(np.clip(parabola_minimum(sweeps, means, options.fitted), best - step, best + step))
