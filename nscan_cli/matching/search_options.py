"""Options of the search for a pose without a good start."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SearchOptions:
    """How far and how finely a pose is searched."""

    distance: float = 4.5
    """Greatest shift to each side, m. The default covers two scans 3 m apart whose starts are 1.5 m off, one
    of them also turned by 30°. A larger value takes longer, and finds poses farther away."""
    turn: float = 1.1
    """Greatest rotation to each side, rad. The default covers two starts that are turned by 30° each. A
    larger value takes longer, and finds poses that are turned more."""
    cell: float = 0.2
    """Side of a cell of the field and of the lattice of poses, m. Larger cells are faster and less exact."""
    spread: float = 0.15
    """Standard deviation by which points are blurred, m. With a larger value poses near each other score
    alike."""
    beams: int = 90
    """Most points of a scan that are used. More take longer, and tell similar places apart better."""
    lever: float = 15.0
    """Distance at which the step between two angles moves a point by one cell, m. A larger value gives a
    finer step, which takes longer."""
