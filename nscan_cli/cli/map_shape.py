"""Options of `render` that change the map to hand it over: --align, --crop and --clean."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nscan_cli.cli.shared_options import Command, with_options
from nscan_cli.cli.subcommand import PATH, Parsed, option
from nscan_cli.errors import WrongUsageError
from nscan_cli.files.outputs import write_atomically

if TYPE_CHECKING:
    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.mapping.cropping import Box
    from nscan_cli.mapping.occupancy import OccupancyGrid
    from nscan_cli.poses import Indices

AUTO = "auto"


def _box_from(text: str) -> Box | str:
    """X0,Y0,X1,Y1 in m, the lower left and the upper right corner, or AUTO."""
    if text == AUTO:
        return text
    try:
        x0, y0, x1, y1 = (float(part) for part in text.split(","))
    except ValueError as error:
        problem = f"{text!r} is not of the form X0,Y0,X1,Y1, as in -10,-5,30,25, nor {AUTO}"
        raise ValueError(problem) from error
    if not all(math.isfinite(part) for part in (x0, y0, x1, y1)) or x0 >= x1 or y0 >= y1:
        raise ValueError(f"{text!r} is not a lower left corner before an upper right one")
    return (x0, y0, x1, y1)


BOX = Parsed(f"X0,Y0,X1,Y1|{AUTO}", _box_from)


@dataclass(frozen=True)
class MapShape:
    """What is done to a map, in this order: it is turned, cleaned and cropped."""

    align: bool
    clean: bool
    removed: str | None
    """File for a picture of what cleaning has removed."""
    crop: Any
    """A Box, AUTO, or None."""


@dataclass(frozen=True)
class ShapedMap:
    """A map, and the graph in its frame."""

    grid: OccupancyGrid
    graph: Graph
    turn: float | None = None
    """The turn about the origin, rad; None if it was not asked for."""
    removed: dict[str, int] | None = None
    """What cleaning has removed: name → cells."""

    def comments(self) -> list[str]:
        """What the YAML says about the frame of the map."""
        if self.turn is None:
            return []
        c, s = math.cos(self.turn), math.sin(self.turn)
        return [
            f"turned by {math.degrees(self.turn):.2f} degrees: a pose (x, y, a) of the graph lies here at",
            f"({c:.9f} x {-s:+.9f} y, {s:.9f} x {c:+.9f} y, a {self.turn:+.9f})",
        ]

    def facts(self, output: str, scans: int) -> dict[str, Any]:
        """The object that `render --json` prints, in m and degrees. Its keys are always the same."""
        height, width = self.grid.shape
        return {
            "map": output,
            "scans": scans,
            "resolution": self.grid.resolution,
            "width": width,
            "height": height,
            "bounds": [round(edge, 6) + 0.0 for edge in self.grid.bounds],
            "turned": None if self.turn is None else round(math.degrees(self.turn), 6) + 0.0,
            "removed": self.removed,
        }


def shape_options(command: Command) -> Command:
    """Add --align, --crop, --clean and --removed; the command gets them as `shape`, a MapShape."""
    options = [
        option("--align", is_flag=True, help="Turn the map so that most walls lie along its axes."),
        option("--crop", type=BOX, metavar=BOX.name,
               help="Cut the map to a rectangle (m), or to what is mapped (auto)."),
        option("--clean", is_flag=True,
               help="Remove free space that the path does not reach, single specks, and people who passed."),
        option("--removed", type=PATH, metavar="PICTURE.png", help="Draw what --clean removes, as a PNG."),
    ]  # fmt: skip

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        shape = MapShape(*(kwargs.pop(name) for name in ("align", "clean", "removed", "crop")))
        if shape.removed is not None and not shape.clean:
            raise WrongUsageError("--removed draws what --clean removes; give --clean, too")
        return command(*args, shape=shape, **kwargs)

    return with_options(wrapped, options)


def shaped_map(
    shape: MapShape, graph: Graph, log: LaserLog, nodes: Indices, rows: Indices, resolution: float
) -> ShapedMap:
    """The map of the scans in `rows` (N,) at `nodes` (N,), and the graph in its frame.

    The picture of what is removed is written.
    """
    from nscan_cli.mapping.occupancy import occupancy_grid

    grid = occupancy_grid(log, rows, graph.poses[nodes], resolution)
    turn = removed = None
    if shape.align:
        from nscan_cli.graph.model import turned_graph
        from nscan_cli.mapping.wall_alignment import wall_alignment

        turn = wall_alignment(grid)
        graph = turned_graph(graph, turn)
        grid = occupancy_grid(log, rows, graph.poses[nodes], resolution)
    if shape.clean:
        from nscan_cli.mapping.cleaning import cleaned_map

        grid, cells = cleaned_map(grid, log, rows, graph.poses[nodes])
        removed = cells.counts()
        if shape.removed is not None:
            from nscan_cli.mapping.figures.canvas import figure_png
            from nscan_cli.mapping.figures.map_plots import plot_removed

            write_atomically(shape.removed, figure_png(plot_removed(grid, cells).image()))
    if shape.crop is not None:
        from nscan_cli.mapping.cropping import automatic_box, cropped_grid

        box: Box = automatic_box(grid, graph.poses[:, :2]) if shape.crop == AUTO else shape.crop
        grid = cropped_grid(grid, box)
    return ShapedMap(grid, graph, turn, removed)
