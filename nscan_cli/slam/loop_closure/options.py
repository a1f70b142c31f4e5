"""Options of step 4 of the loop: where places seen before are searched, and how they are verified."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from nscan_cli.matching.search_options import SearchOptions


class FreeSpaceOptions(NamedTuple):
    """When one visit looks through too much of what another one saw."""

    keyframes: int = 40
    """Number of keyframes that are judged together. In a sound map few keyframes see a change: the worst ten
    of fr-campus look through 24 % of what was there before, the worst forty 8 %. A larger number warns
    less."""
    min_keyframes: int = 3
    """Least number of keyframes at places seen before. A larger number judges fewer maps."""
    min_points: int = 50
    """Least number of compared points of a keyframe that counts. A larger number counts fewer keyframes."""
    compared: int = 8
    """Number of other keyframes that each is compared with: the nearest of other visits, and as many of its
    own. More take longer."""
    tolerance: float = 0.2
    """A point is looked through if it is nearer by this than the shortest of four neighbouring beams, m. A
    larger value warns less."""
    tolerance_per_metre: float = 0.02
    """Growth of the tolerance with the range, m/m. A larger value warns less."""
    within_factor: float = 2.5
    """A sound map looks through at most this multiple of the share within visits. It is 0.5 to 1.6 in real
    buildings, and 4 to 300 in simulated maps that are metres wrong. A larger value warns less."""
    margin: float = 0.01
    """Share that is added to that bound. A larger value warns less."""
    max_share: float = 0.15
    """Upper limit of that bound. The share is 0.08 in mit-killian and fr-campus, and 0.26 and more in maps of
    these that are metres wrong. A larger value warns less."""


@dataclass(frozen=True)
class LoopClosureOptions:
    """The search for a place seen before, and what its result has to stand."""

    drift: float = 0.05
    """Standard deviation of tracking slips, m/√m. A larger one searches more often and farther."""
    drift_angle: float = 0.002
    """Standard deviation of tracking slips, rad/√m. A larger one searches more often and farther."""
    disagreement: float = 4.0
    """Tracking may have slipped where it differs from odometry by more than the usual difference times this.
    A larger number searches less far after such a step."""
    turning: float = 0.4
    """Steps from keyframe to keyframe that turn by more than this have a usual difference of their own, rad:
    in turns wheels slip. With a smaller value fewer of the other steps disagree."""
    min_compared_steps: int = 20
    """Number of steps of a kind after which their usual difference is known. A larger number finds slips
    later."""
    usual_steps: int = 1000
    """Number of the last steps of a kind whose median difference is the usual one. A larger number follows
    changes more slowly."""
    lever_arm: float = 20.0
    """Distance at which angles count when paths are compared by their uncertainty, m. With a larger one,
    paths with certain angles are preferred."""
    sigmas: float = 3.0
    """A keyframe may be off by this many standard deviations. A larger number searches more."""
    match_reach: float = 1.0
    """A joint match finds the place itself if a keyframe is off by less, m. A larger distance searches
    less."""
    max_exact_keyframes: int = 500
    """Largest graph whose uncertainty is computed as a whole. Of a larger one the part nearest to the
    keyframe is, of this many keyframes, with the paths to all that may be searched. A larger number is
    slower."""
    search_interval: float = 3.0
    """Least length of path between two searches, m. A larger one searches less."""
    search: SearchOptions = field(default_factory=lambda: SearchOptions(beams=180))
    """How a place is searched; its distance and turn follow from how far the keyframe may be off."""
    min_distance: float = 4.0
    """Least distance that is searched, m: a slip while all else is well known. A larger one is slower."""
    min_turn: float = 0.3
    """Least angle that is searched, rad. A larger one is slower."""
    max_distance: float = 100.0
    """Largest distance that is searched, m. In a map smaller than half of this, half of it is. A larger one
    closes larger loops and is slower."""
    scan_path: float = 6.0
    """Keyframes within this length of path are searched together with the centre, m. A larger one tells
    places apart better, and drifts more."""
    earlier_radius: float = 15.0
    """Largest distance of keyframes of the earlier visit from where the place may be, m. A larger one
    compares with more of that visit."""
    min_score: float = 0.55
    """Least share of points that fit at a place. A larger share refuses more."""
    min_lost_visit: int = 3
    """Least number of keyframes in one piece of an earlier visit among which a keyframe is searched that may
    be anywhere: a short piece tells no place, and there may be hundreds. A larger number searches less."""
    max_lost_searches: int = 3
    """Most pieces of the map among which one keyframe is searched that may be anywhere: they take turns. A
    larger number finds places earlier where the track broke often, and takes longer."""
    min_score_far: float = 0.45
    """Least share of points that fit where the path may be off by more than `min_distance`. It is smaller
    than `min_score`: only such a loop corrects the path there, and a laser that looks ahead sees half of what
    it saw from the opposite direction. A larger share refuses more."""
    rival_score: float = 0.88
    """A place is ambiguous if another one scores this share of its score. A larger share refuses less."""
    rival_distance: float = 1.5
    """What is farther off than this is another place, m. A larger distance refuses less."""
    agreement_distance: float = 0.5
    """Largest difference between the places that two keyframes find, m. A larger one accepts more."""
    agreement_turn: float = 0.05
    """Largest difference between the places that two keyframes find, rad. A larger one accepts more."""
    agreement_path: float = 30.0
    """Largest length of path between keyframes that agree, m. A larger one accepts more."""
    stretch_radius: float = 10.0
    """If single scans of both visits see too little of the same, keyframes within this distance beyond
    `radius` of the centre are matched together, m. A larger radius sees more of both visits and takes
    longer."""
    stretch_scans: int = 20
    """Most keyframes of such a match, half of them of other visits. More take longer."""
    stretch_overlap: float = 0.55
    """Least share of inliers, of one scan on another, that ties two scans of such a match. A larger share
    refuses more."""
    min_agreeing: int = 2
    """Number of keyframes that have to find the same place. A larger number accepts less."""
    min_agreeing_doubtful: int = 3
    """Number of keyframes that have to find the same place if the track has broken since, or if the place is
    farther off than the path drifts: there distance does not tell apart rooms that look alike. A larger
    number accepts less."""
    drift_sigmas: float = 2.5
    """A place is farther off than the path drifts if it is off by more standard deviations than this, and by
    more than `slip_distance`. A larger number accepts more."""
    slip_distance: float = 5.0
    """Largest distance by which tracking slips, m. A larger one accepts more."""
    free_space: FreeSpaceOptions = field(default_factory=FreeSpaceOptions)
    """When visits of the finished map contradict each other."""
    max_mean_chi2: float = 3.0
    """Loops contradict the rest of the graph if the mean χ² of all relations, with three degrees of freedom,
    is larger. It is below 1 on sound logs. A larger value maps less often without them, and warns less."""
    least_closed_share: float = 0.25
    """Without odometry, such a map must close loops for this share of the keyframes for which loops were
    closed before: half of these and more may be wrong. A larger share keeps fewer such maps."""
    contradicted_distance: float = 20.0
    """Where visits of a place contradict each other in the finished map, the search covers at least this
    distance, m. A larger one mends larger errors and is slower."""
    contradicted_share: float = 0.5
    """What such a search finds is kept if the map is sound by it, or if beams pass through at most this share
    of what they passed through before. A larger share keeps more."""
