"""The outputs of `slam`: the graph, and other files on request."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from nscan_cli.cli.map_output import check_map_outputs, write_map, yaml_path
from nscan_cli.cli.picture_names import check_document_name
from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.inputs import label
from nscan_cli.files.limits import DISTANCE
from nscan_cli.files.outputs import check_writable, write_atomically

if TYPE_CHECKING:
    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.mapping.map_server import MapImage
    from nscan_cli.poses import Array, Indices


@dataclass(frozen=True)
class SlamOutputs:
    """Paths of the outputs, None for those not requested. Only the graph's may be "-", standard output."""

    graph: str
    map: str | None
    resolution: float
    """Size of a cell of the map, m."""
    trajectory: str | None
    g2o: str | None
    carmen: str | None
    depfile: str | None

    @property
    def need_scans(self) -> bool:
        """Whether an output needs the scans, not only the graph."""
        return self.map is not None or self.carmen is not None

    def files(self) -> list[str]:
        """The paths of all output files, the graph's first, without standard output."""
        maps = [] if self.map is None else [self.map, yaml_path(self.map)]
        paths = [self.graph, *maps, self.trajectory, self.g2o, self.carmen, self.depfile]
        return [path for path in paths if path not in (None, "-")]

    def check(self, inputs: Sequence[str]) -> None:
        """Check that all outputs can be written, have different names, and replace no input.

        Raises WrongUsageError and OutputError.
        """
        others = (self.trajectory, self.g2o, self.carmen, self.depfile)
        if "-" in (self.map, *others):
            raise WrongUsageError(
                "slam: only the graph (-o) can go to standard output; name files for the rest"
            )
        check_document_name(
            self.graph, "the graph in JSON", "give -o GRAPH.json, and --map MAP.png for the map"
        )
        if self.map is not None:
            check_map_outputs(self.map, yaml=True)
        files = [os.path.realpath(path) for path in self.files()]
        if len(set(files)) < len(files):
            raise WrongUsageError("slam: two outputs have the same name; give each its own")
        for source in inputs:
            if source != "-" and os.path.realpath(source) in files:
                raise WrongUsageError(f"slam: {source} is both an input and an output; choose another name")
        for path in (self.graph, *others):
            check_writable(path)

    def write(
        self,
        graph: Graph,
        scans: LaserLog | None,
        rows: Indices,
        inputs: Sequence[str],
        threads: int,
        quiet: bool,
    ) -> None:
        """Write all outputs; `rows` (N,) are those of the graph's scans, `inputs` are for the depfile."""
        from nscan_cli.graph.io.json_graph import write_graph
        from nscan_cli.memory import release_memory
        from nscan_cli.threads import in_background, short_switch_interval

        release_memory()
        farthest = float(abs(graph.poses[:, :2]).max())
        if farthest > DISTANCE.value:
            problem = f"leads to a pose {farthest:.3g} m away, beyond the limit for graphs"
            raise InputDataError(
                label(inputs[0]), problem, f"look for jumps, or set {DISTANCE.variable} higher"
            )
        image = None
        with short_switch_interval(threads):
            if scans is not None and self.map is not None:
                image = in_background(
                    threads, partial(_draw_map, scans, rows, graph.poses, self.resolution, threads)
                )
            write_atomically(self.graph, write_graph(graph))
        if self.trajectory is not None:
            from nscan_cli.graph.io.tum import write_tum

            write_atomically(self.trajectory, write_tum(graph.stamps, graph.poses))
        if self.g2o is not None:
            from nscan_cli.graph.io.g2o import write_g2o

            write_atomically(self.g2o, write_g2o(graph))
        if scans is not None and self.carmen is not None:
            from nscan_cli.exports.carmen import corrected_log

            write_atomically(self.carmen, corrected_log(scans, rows, graph.poses))
        if image is not None and self.map is not None:
            # The map comes last: if it is too large, the other outputs are there.
            write_map(self.map, image(), yaml=True, quiet=quiet)
        if self.depfile is not None:
            write_atomically(self.depfile, self._rule(inputs))

    def _rule(self, inputs: Sequence[str]) -> bytes:
        """`outputs: inputs` as a rule for make, with spaces, # and $ escaped."""

        def escaped(path: str) -> str:
            return path.replace("$", "$$").replace(" ", "\\ ").replace("#", "\\#")

        targets = " ".join(escaped(path) for path in self.files() if path != self.depfile)
        # make cannot look for standard input.
        prerequisites = "".join(f" {escaped(path)}" for path in inputs if path != "-")
        return os.fsencode(f"{targets}:{prerequisites}\n")


def _draw_map(scans: LaserLog, rows: Indices, poses: Array, resolution: float, threads: int) -> MapImage:
    """The picture of the map. Memory of earlier steps is released before."""
    from nscan_cli.mapping.map_server import map_image
    from nscan_cli.mapping.occupancy import occupancy_grid
    from nscan_cli.memory import trim_heap

    grid = occupancy_grid(scans, rows, poses, resolution, threads)
    trim_heap()
    return map_image(grid)
