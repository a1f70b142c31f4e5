"""The search for the place of a keyframe among those of an earlier visit, without a good start.

The scans around the keyframe are searched together, by branch and bound.
"""

from __future__ import annotations

from nscan_cli.graph.model import Loop
from nscan_cli.matching.correlative_search import Search, SearchOptions
from nscan_cli.poses import Indices
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.joint_relations import LocalMatcher
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.search_submaps import search_submaps
from nscan_cli.slam.loop_closure.verification import verify_place


def find_place(
    route: Route,
    centre: int,
    earlier: Indices,
    window: SearchOptions,
    match: LocalMatcher,
    closing: LoopClosureOptions,
    nscan: NScanOptions,
) -> Place | Loop | None:
    """The place of keyframe `centre` among the `earlier` ones (m,) after verification, or why it is refused.

    None when nothing fits.
    """
    sought = search_submaps(route, centre, earlier, window, closing)
    if sought is None:
        return None
    scan, field = sought
    about = Search(field, scan, route.poses[centre], window)
    is_far = window.distance > closing.min_distance
    found = about.best(closing.min_score_far if is_far else closing.min_score)
    return (
        None if found is None else verify_place(route, centre, earlier, about, found, match, closing, nscan)
    )
