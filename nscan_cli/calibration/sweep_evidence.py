"""How long a sweep of the laser takes, by its scans.

They fit best if every beam is seen from where the robot was. If the robot turns during a sweep of the laser,
the scan is stretched or compressed by its motion; if it stands, the scan is not. So two scans that were taken
during different motions fit best with the true time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.robust_fit import TO_SIGMA
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.poses import Array, Indices


@dataclass(frozen=True)
class SweepEvidence:
    """What pairs of scans say of times of a sweep."""

    sweeps: Array
    """(T,) the times that were tried, s; negative: readings in the reverse order of time."""
    energies: Array
    """(P, T) energy of each of P pairs matched with each time, per point; smaller is sharper."""
    first: Indices
    """(P,) row of the first scan of each pair."""
    options: SweepCheckOptions

    def sigmas(self, better: float, worse: float) -> float:
        """By how many standard deviations one of the times fits better than another.

        Pairs that begin with one scan are wrong together, so their mean counts once. 0 with too few scans.
        """
        if self.is_little:
            return 0.0
        places = [int(np.argmin(np.abs(self.sweeps - sweep))) for sweep in (better, worse)]
        own = np.unique(self.first, return_inverse=True)[1]
        gains = self._clipped(self.energies[:, places[1]] - self.energies[:, places[0]])
        gains = np.bincount(own, gains) / np.bincount(own)
        spread = float(gains.std(ddof=1)) / np.sqrt(len(gains))
        return float(gains.mean()) / max(float(spread), 1e-12)

    @property
    def is_little(self) -> bool:
        """Whether too few scans were compared with others."""
        return len(np.unique(self.first)) < self.options.min_pairs

    @property
    def sharpest(self) -> float:
        """The time with the least energy of all pairs, s."""
        if not len(self.energies):
            return float(self.sweeps[0])
        gains = self._clipped(self.energies - self.energies[:, :1])
        return float(self.sweeps[int(np.argmin(gains.mean(axis=0)))])

    def _clipped(self, values: Array) -> Array:
        """Columns (P, ...) without what is far from their medians."""
        middle = np.median(values, axis=0)
        most = self.options.outlier_sigmas * TO_SIGMA * np.median(np.abs(values - middle), axis=0)
        return np.clip(values, middle - most, middle + most)


def sweep_evidence(
    motion: ScanMotion, sweeps: Sequence[float], told: float, options: SweepCheckOptions
) -> SweepEvidence:
    """What the scans of a log say of some times of a sweep, s, without its odometry and times of beams.

    No more pairs are compared where `told`, one of those times, fits better than the others, or another far
    better than it. Times that fit clearly worse than it are left out.
    """
    evidence = SweepEvidence(np.array(sweeps), np.empty((0, len(sweeps))), np.empty(0, np.int64), options)
    longest = max(abs(sweep) for sweep in sweeps)
    for one, other in turning_pairs(motion, longest, options, options.scans, options.pairs):
        if motion.change_of_turn(one, other) * longest <= options.min_winding:
            # The estimate of single ranges was wrong.
            continue
        energies = motion.energies(one, other, evidence.sweeps.tolist())
        if energies is not None:
            energies, first = np.vstack([evidence.energies, energies]), np.append(evidence.first, one)
            evidence = replace(evidence, energies=energies, first=first)
            if _is_settled(evidence, told, options) or len(evidence.energies) == options.pairs:
                break
            evidence = _without_worse(evidence, told, options)
    return evidence


def _is_settled(evidence: SweepEvidence, told: float, options: SweepCheckOptions) -> bool:
    """Whether the time that the file tells fits better than the others already, or far worse than another.

    Or whether others fit hardly better than it, so that more pairs would not make one certain. Where the file
    tells a time, another one may be as near to the true one, so a few pairs do not show that.
    """
    pairs, best = len(evidence.energies), evidence.sharpest
    if pairs < options.least_pairs or evidence.is_little:
        return False
    is_decisive, certainty = pairs >= options.least_decisive, evidence.sigmas(best, told)
    if certainty < options.hopeless_sigmas and (is_decisive or best != told == 0.0):
        return True
    if best != told and not (is_decisive and certainty >= options.decided_sigmas):
        return False
    others = (sweep for sweep in evidence.sweeps.tolist() if sweep != best)
    return all(evidence.sigmas(best, sweep) >= options.settled_sigmas for sweep in others)


def _without_worse(evidence: SweepEvidence, told: float, options: SweepCheckOptions) -> SweepEvidence:
    """The evidence without the times that fit clearly worse than the one that the file tells."""
    if len(evidence.energies) < options.least_decisive:
        return evidence
    kept = [evidence.sigmas(told, sweep) < options.dropped_sigmas for sweep in evidence.sweeps.tolist()]
    return replace(evidence, sweeps=evidence.sweeps[kept], energies=evidence.energies[:, kept])


def turning_pairs(
    motion: ScanMotion, sweep: float, options: SweepCheckOptions, scans: int, most: int
) -> Iterator[tuple[int, int]]:
    """Rows of two scans each between which the motion has changed, first those that begin with so many of
    the fastest turns among so many `scans`. Where there are few turns, scans beside these are among them.
    """
    fast = motion.turning_rows(motion.spread_rows(options, scans), sweep, options)
    if len(fast) < options.pairs:
        beside = motion.rows_beside(fast, options.scans_beside)
        fast = np.concatenate([fast, motion.turning_rows(beside, sweep, options)])
    yield from _pairs_of(fast[:most], motion, sweep, options)
    yield from _pairs_of(fast[most:], motion, sweep, options)


def _pairs_of(
    fast: Indices, motion: ScanMotion, sweep: float, options: SweepCheckOptions
) -> Iterator[tuple[int, int]]:
    """Pairs that begin with these rows; no scan is first again before all were."""
    shifts = np.array(options.shifts)
    for begin in range(len(shifts)):
        # Each scan begins with another shift, and comes to all of them.
        others = fast + shifts[(begin + np.arange(len(fast))) % len(shifts)]
        inside = (others >= 1) & (others <= len(motion.log) - 2)
        found = np.stack([fast[inside], others[inside]], axis=1)
        rates = motion.rates(found.ravel()).reshape(-1, 2)
        seconds = np.abs(np.diff(motion.log.times[found], axis=1)[:, 0])
        used = np.abs(rates[:, 1] - rates[:, 0]) * sweep > options.min_winding
        used &= 0.5 * np.abs(rates.sum(axis=1)) * seconds <= options.max_apart
        yield from found[used].tolist()
