"""`nscan-cli render`: the map of a graph, for robots or for people."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nscan_cli.cli.options import CONTEXT, common_options, reading_options
from nscan_cli.cli.output import check_writable, is_device, write_whole
from nscan_cli.cli.progress import say
from nscan_cli.errors import InputDataError, InputMissingError, WrongUsageError
from nscan_cli.logs.options import ReadingOptions

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.scan import LaserLog
    from nscan_cli.mapping.occupancy import OccupancyGrid


@click.command("render", context_settings=CONTEXT)
@click.argument("graph_file", metavar="GRAPH.json")
@click.argument("log", required=False)
@click.option("-o", "--output", required=True, metavar="MAP.png", help="The picture; - for standard output.")
@click.option(
    "--resolution",
    type=click.FloatRange(0.001, 10),
    default=0.05,
    show_default=True,
    metavar="M",
    help="Size of a cell.",
)
@click.option("--trajectory", is_flag=True, help="Draw the path.")
@click.option("--graph", is_flag=True, help="Draw keyframes and relations.")
@click.option("--uncertainty", is_flag=True, help="Draw the uncertainty of the keyframes' positions.")
@click.option(
    "--style",
    type=click.Choice(["map_server", "paper"]),
    default="map_server",
    show_default=True,
    help="A map for robots, or points and path on white with axes.",
)
@click.option(
    "--yaml/--no-yaml",
    default=None,
    help="Write MAP.yaml for map_server and Nav2 beside the map; done for plain maps.",
)
@reading_options
@common_options
def command(
    graph_file: str,
    log: str | None,
    output: str,
    resolution: float,
    trajectory: bool,
    graph: bool,
    uncertainty: bool,
    style: str,
    yaml: bool | None,
    reading: ReadingOptions,
    quiet: bool,
    **_verbosity: int,
) -> None:
    """Draw the occupancy map of a graph, a result of slam, from the scans of its LOG.

    LOG is looked for beside the graph, then in the current folder, when it is not given; it is read as
    slam has read it where no option says otherwise. The map is an 8-bit gray PNG with a YAML for
    map_server and Nav2. With overlays or in the style of a paper it is a picture in colour for people,
    which robots cannot load: no YAML is written then.
    """
    picture = trajectory or graph or uncertainty or style == "paper"
    if yaml and picture:
        raise WrongUsageError("--yaml describes a plain map, not a picture in colour; leave one of them out")
    in_file = output != "-" and not is_device(output)
    if yaml and not in_file:
        raise WrongUsageError("--yaml needs a map in a file; give -o MAP.png, or leave out --yaml")
    yaml = in_file and not picture if yaml is None else yaml
    check_map_outputs(output, yaml)
    if graph_file == "-" and log == "-":
        raise WrongUsageError("standard input (-) can be one input only; give the other by its path")
    from nscan_cli.graph.json_file import read_graph
    from nscan_cli.mapping.occupancy import occupancy_grid

    whole = read_graph(graph_file)
    scans, nodes, rows = _read_scans(graph_file, whole, log, reading)
    poses = whole.poses[nodes]
    grid = occupancy_grid(scans, rows, poses, resolution)
    if picture:
        from nscan_cli.mapping.drawing import Overlays, draw_figure, draw_over_map

        if uncertainty and not whole.marginals:
            say(f"warning: {graph_file} has no covariances, so no uncertainty is drawn", quiet)
        overlays = Overlays(trajectory, graph, uncertainty)
        if style == "paper":
            canvas = draw_figure(scans, rows, poses, grid, whole, overlays)
        else:
            canvas = draw_over_map(grid, whole, overlays)
        write_whole(output, canvas.png())
    else:
        write_map(output, grid, yaml)
    if output != "-":
        low_x, low_y, high_x, high_y = grid.bounds
        say(f"{output}: {high_x - low_x:.1f} m × {high_y - low_y:.1f} m from {len(rows)} scans", quiet)


def check_map_outputs(output: str, yaml: bool) -> None:
    """Refuse a map, and the YAML beside it, that could never be written. Raises OutputError."""
    check_writable(output)
    if yaml:
        if yaml_path(output) == output:
            raise WrongUsageError(f"{output}: the map would have the name of its YAML; name it like MAP.png")
        check_writable(yaml_path(output))


def write_map(output: str, grid: OccupancyGrid, yaml: bool) -> None:
    """Write a map for map_server, and with `yaml` the YAML beside it, which a loader looks for last."""
    from nscan_cli.mapping.image import map_png, map_yaml

    write_whole(output, map_png(grid))
    if yaml:
        write_whole(yaml_path(output), map_yaml(Path(output).name, grid))


def yaml_path(output: str) -> str:
    """Where the YAML of a map is: beside it."""
    return str(Path(output).with_suffix(".yaml"))


def _read_scans(
    graph_file: str, graph: Graph, log_file: str | None, reading: ReadingOptions
) -> tuple[LaserLog, NDArray[np.int64], NDArray[np.int64]]:
    """The graph's log; the nodes (N,) whose scans are to be drawn, and the rows (N,) of their scans.

    Raises InputDataError when it is another log than the graph's.
    """
    import numpy as np

    from nscan_cli.logs.load import read_log

    sources = graph.provenance.get("inputs") or [{}]
    path = _find_log(graph_file, sources[0].get("name")) if log_file is None else log_file
    log = read_log(path, _as_tracked(reading, graph.provenance))
    sha256 = sources[0].get("sha256")
    remedy = "give the log that the graph was made from"
    if sha256 is not None and sha256 != log.source.sha256:
        raise InputDataError(path, f"is not the log of {graph_file}: its SHA-256 is another", remedy)
    rows = np.minimum(np.searchsorted(log.numbers, graph.scans), len(log) - 1)
    there = log.numbers[rows] == graph.scans
    some_left_out = reading.start is not None or reading.end is not None or reading.every > 1
    if not there.all() and not some_left_out:
        number = int(graph.scans[np.argmin(there)])
        raise InputDataError(path, f"has no scan {number}, which {graph_file} has", remedy)
    return log, np.flatnonzero(there), rows[there]


def _find_log(graph_file: str, name: str | None) -> str:
    """The path of the log `name`, beside the graph or in the current folder. Raises InputMissingError."""
    if name is None:
        raise InputMissingError(f"{graph_file}: does not name its log; give LOG after it")
    for folder in (Path(graph_file).parent, Path()):
        path = folder / Path(name).name
        if path.is_file():
            return str(path)
    raise InputMissingError(
        f"{graph_file}: its log {name} is neither beside it nor in the current folder; give LOG after it"
    )


def _as_tracked(reading: ReadingOptions, provenance: dict[str, Any]) -> ReadingOptions:
    """The options that the graph's log was read with, where `reading` does not say otherwise.

    But which scans there are, the graph itself says; `reading` may leave out more.
    """
    choices = {"start", "end", "every"}
    tracked = provenance.get("parameters", {}).get("reading", {})
    default = ReadingOptions()
    kept: dict[str, Any] = {}
    for option in dataclasses.fields(ReadingOptions):
        unsaid = getattr(reading, option.name) == getattr(default, option.name)
        if unsaid and option.name in tracked and option.name not in choices:
            value = tracked[option.name]
            kept[option.name] = tuple(value) if isinstance(value, list) else value
    return dataclasses.replace(reading, **kept)
