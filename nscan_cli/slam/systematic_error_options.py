"""The options of `systematic_error`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SystematicErrorOptions:
    """When a drive is mapped again without a systematic error of its odometry."""

    window: float = 4.0
    """Length of the pieces of the path that are compared, m. Longer ones have less noise, and are fewer."""
    min_straightness: float = 0.5
    """Least distance between both ends of a piece, as a share of its length. A larger share leaves out more
    pieces with turns."""
    min_pieces: int = 8
    """Least number of pieces that make an error certain. A larger number leaves more odometry as it is."""
    sigmas: float = 6.0
    """An error is certain if it exceeds this number of its standard deviations. A larger number leaves more
    odometry as it is."""
    parts: int = 4
    """Number of parts of the drive in each of which ways are off. More parts leave more odometry as it is."""
    min_part: float = 0.5
    """Least share of the mean by which they are off in each part. A larger share leaves more odometry as it
    is."""
    min_length: float = 0.05
    """Least share by which ways are too long or too short. A larger share leaves more odometry as it is."""
    max_length: float = 0.4
    """Largest share by which ways are too long or too short. Where it is larger, the scans may tell none, as
    with dust in front of the laser. A larger share corrects more odometry."""
    min_more_length: float = 0.02
    """Least share by which ways are too long or too short once the drive was mapped again. A larger share
    stops earlier."""
    max_runs: int = 3
    """Largest number of times that a drive is mapped again. A larger number takes longer."""
