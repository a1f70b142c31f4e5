"""How far a map can be trusted without ground truth: its drive is mapped again, and the maps must agree."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from nscan_cli.files.provenance import as_parameters
from nscan_cli.graph.model import Graph
from nscan_cli.graph.relative_covariance import RelativePoses
from nscan_cli.poses import Indices
from nscan_cli.slam.consistency.contradicted_rows import contradicted_rows
from nscan_cli.slam.consistency.options import VerificationOptions
from nscan_cli.slam.consistency.path_differences import PathDifference, path_differences
from nscan_cli.slam.consistency.repeated_maps import WITHOUT_ODOMETRY, MappedPath, repeats
from nscan_cli.slam.state import SlamState
from nscan_cli.threads import map_in_threads


@dataclass(frozen=True)
class Repeat:
    """One run that had to give the same map."""

    name: str
    path: MappedPath
    differences: list[PathDifference]

    @property
    def counts(self) -> bool:
        """Whether a difference says something about the map.

        A repeat without odometry can be wrong where the map is right. Mostly it warns then.
        """
        return self.name != WITHOUT_ODOMETRY or not self.path.notices


@dataclass(frozen=True)
class Verification:
    """What mapping a drive again says of its map."""

    repeats: list[Repeat]
    options: VerificationOptions

    @property
    def worst(self) -> tuple[str, PathDifference] | None:
        """The greatest difference of the runs that count, and its run; None where nothing is compared."""
        found = [(run.name, each) for run in self.repeats if run.counts for each in run.differences]
        return max(found, key=lambda named: named[1].max, default=None)

    def as_document(self, numbers: Indices) -> dict[str, Any]:
        """For JSON, in m; `numbers` (S,) are those of the log's scans."""
        return {
            "greatest": None if self.worst is None else self.worst[1].max,
            "bound": self.options.bound,
            "repeats": [
                {
                    "change": run.name,
                    "counts": run.counts,
                    "breaks": len(run.path.breaks),
                    "notices": list(run.path.notices),
                    "differences": [
                        asdict(each) | {"first": int(numbers[each.first]), "last": int(numbers[each.last])}
                        for each in run.differences
                    ],
                }
                for run in self.repeats
            ],
        }

    def notice(self, numbers: Indices) -> str | None:
        """A sentence where maps differ by more than those of a sound map do; None if they do not."""
        if self.worst is None or self.worst[1].max <= self.options.max_difference:
            return None
        name, worst = self.worst
        said = "unknown" if worst.sigma is None else f"{worst.sigma:.2g} m"
        return (
            f"mapped again ({name}), the map differs by {worst.max:.2f} m over {worst.way:g} m, from scan "
            f"{numbers[worst.first]} to {numbers[worst.last]}, where sigma is {said}: one of the two is wrong"
        )


def verify(state: SlamState, graph: Graph, options: VerificationOptions, threads: int) -> Verification:
    """Map the drive of a finished run again, and compare."""
    log, slam = state.recorded, state.options
    rows, breaks = np.arange(len(log)), np.array(state.breaks, dtype=np.int64)
    # A map without odometry is no better told than its repeats.
    path = MappedPath(rows, graph.poses, breaks, (), rows if log.odometry is None else state.degenerate_scans)
    runs = repeats(log)
    paths = map_in_threads(threads, lambda run: run(log, slam), runs.values())
    paths = [
        replace(again, contradicted=contradicted_rows(log, path, again, options))
        if name == WITHOUT_ODOMETRY and not again.notices
        else again
        for name, again in zip(runs, paths, strict=True)
    ]
    found = [path_differences(path, again, options) for again in paths]
    ends = [row for some in found for each in some for row in (each.first, each.last)]
    known = RelativePoses(graph, np.unique(graph.anchors[ends]).tolist())
    return Verification(
        [
            Repeat(name, again, [replace(each, sigma=_sigma(graph, known, each)) for each in some])
            for name, again, some in zip(runs, paths, found, strict=True)
        ],
        options,
    )


def add_verification(state: SlamState, graph: Graph, options: VerificationOptions, threads: int) -> None:
    """Map the drive again; the graph's provenance gets the differences, and a notice if they are large."""
    found, numbers, provenance = verify(state, graph, options, threads), state.log.numbers, graph.provenance
    provenance["parameters"]["verification"] = as_parameters(options)
    provenance["verification"] = found.as_document(numbers)
    notice = found.notice(numbers)
    if notice is not None:
        provenance["notices"].append(notice)


def _sigma(graph: Graph, known: RelativePoses, difference: PathDifference) -> float | None:
    """What a graph says of a way: standard deviation (m) of the relative position of the keyframes at its
    ends, along the least certain direction."""
    a, b = graph.anchors[[difference.first, difference.last]].tolist()
    if a == b:
        return 0.0
    relation = known.relation(a, b)
    if relation is None:
        return None
    covariance = np.linalg.inv(relation.information)[:2, :2]
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))
