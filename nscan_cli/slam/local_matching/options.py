"""Options of step 3 of the loop: which keyframes are matched with each other, and how."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.matching.joint.options import AmbiguityOptions
from nscan_cli.ndt.options import GaussianOptions


@dataclass(frozen=True)
class NScanOptions:
    """The joint match of a keyframe with its neighbours, or the single matches in its place."""

    gaussians: GaussianOptions = field(default_factory=lambda: GaussianOptions(minimum=4))
    """How the scans of a keyframe become Gaussians."""
    max_scans: int = 10
    """Largest number of keyframes in one match. A larger number relates more of them and takes longer."""
    min_scans: int = 3
    """Least number of keyframes in a joint match. A larger number makes fewer matches."""
    radius: float = 5.0
    """Largest distance from the centre at which a keyframe takes part, m. A larger radius relates keyframes
    farther apart."""
    visit_path: float = 20.0
    """Keyframes within this length of path of the centre are of the same visit, m. With a larger length,
    fewer keyframes count as seen before. Other visits get up to half of the places in a match."""
    max_other_visits: int = 3
    """Number of other visits, the first ones, whose keyframes take part. A larger number closes more loops
    and makes the graph denser."""
    max_covered_share: float = 0.7
    """No match is made about a keyframe if others hold this share of its pairs. A larger share makes more
    matches."""
    centre_delay: int = 3
    """Number of keyframes that the centre of a match is behind the newest. With a larger number more of the
    keyframes after the centre take part, and its relation comes later."""
    loops: bool = True
    """Whether keyframes of other visits take part. Without them the graph keeps the drift of tracking."""
    scale_per_cell: float = 0.3
    """Factor of the energy of scans with one point in each lattice cell: four Gaussians see each point. Of
    scans with n points in a cell, it is divided by n. A larger factor trusts matches more."""
    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """The w of the energy in each stage of a match: it multiplies the information of the Gaussians, so that
    w < 1 widens them. The last w is 1. With larger ones before, matches converge only from nearer."""
    max_iterations: int = 30
    """Most iterations of a stage. A larger number lets slow matches converge."""
    wide_tolerance: float = 5e-3
    """Stages before the last end with a step below this, m and rad. A larger one ends them earlier."""
    tolerance: float = 1e-3
    """The last stage ends with a step below this, m and rad. A larger one ends it earlier."""
    thinning: int = 4
    """Where the last stage runs alone, one point in this number is matched first. A larger number is faster
    and less exact at first."""
    min_overlap: float = 0.65
    """Least share of inliers, of one scan on the other, that ties two scans. A larger share drops more."""
    inlier_bound: float = 9.0
    """Squared Mahalanobis distance from a Gaussian within which a point lies on it. A larger one counts more
    points."""
    ambiguity: AmbiguityOptions = field(default_factory=AmbiguityOptions)
    """How a joint match is checked for other places where its scans fit."""
    start_overlap: float = 0.5
    """Share of `min_overlap` that ties two scans before the last stage alone. A larger share drops more."""
    max_last_stage_motion: float = 0.1
    """If the last stage alone moves a scan further than this, m, or drops one at once, all stages are run. A
    larger distance is faster and less robust."""

    @property
    def attempts(self) -> tuple[tuple[float, ...], ...]:
        """The widenings of each attempt: the last stage alone, and all if that moved a scan far.

        Mostly the poses are right to centimetres already, and the last stage is all it takes.
        """
        last, whole = self.widenings[-1:], self.widenings
        return (last,) if last == whole else (last, whole)
