"""`nscan-cli render`: the map of a graph, as a map for robots or as a figure."""

from __future__ import annotations

import click

from nscan_cli.cli.map_comparison import draw_comparison
from nscan_cli.cli.map_output import check_map_outputs, resolution_option, write_map, yaml_path
from nscan_cli.cli.map_shape import MapShape, shape_options, shaped_map
from nscan_cli.cli.picture_names import MAP_OR_PAGE_SUFFIXES, check_suffix, is_page
from nscan_cli.cli.plot_option import check_second_output, check_second_outputs
from nscan_cli.cli.progress import say
from nscan_cli.cli.result_over_log import load_result, log_of, over_log
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.standard_streams import print_json
from nscan_cli.cli.subcommand import PATH, argument, json_option, option, subcommand
from nscan_cli.errors import WrongUsageError
from nscan_cli.files.inputs import base_name
from nscan_cli.files.outputs import check_writable, is_device, write_atomically
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions


@subcommand(
    "render",
    ("nscan-cli render robot.json robot.log.gz -o robot.png", "a map for robots, robot.png and robot.yaml"),
    ("nscan-cli render robot.json -o figure.png --style paper", "a figure; the log is beside the graph"),
    ("nscan-cli render robot.json -o graph.png --trajectory --graph", "the path and the graph over the map"),
    ("nscan-cli render robot.json -o clean.png --align --clean --crop auto", "a map to hand over"),
    (
        "nscan-cli render robot.json other.tum robot.log.gz -o both.png --compare",
        "another mapper's result, too",
    ),
    ("nscan-cli render robot.json -o robot.html", "a page to zoom, measure, and look at scans and loops"),
)
@argument("graph_file", metavar="GRAPH.json", type=PATH,
          tells="A result of slam; - is standard input. With LOG it may be that of another mapper: a "
          "trajectory in TUM format, or a g2o file whose vertices are numbers of scans.")  # fmt: skip
@argument("log", nargs=-1, type=PATH,
          tells="The log that the graph was made from. Default: looked for beside the graph, then in the "
          "current folder.")  # fmt: skip
@option("-o", "--output", type=PATH, required=True, metavar="MAP.png",
        help="File for the picture; - is standard output.")  # fmt: skip
@resolution_option
@option("--trajectory", is_flag=True, help="Draw the path.")
@option("--graph", is_flag=True, help="Draw keyframes and relations.")
@option("--uncertainty", is_flag=True, help="Draw the uncertainty of the keyframes' positions.")
@option("--compare", is_flag=True,
        help="Draw two results over each other; the second one stands before LOG.")  # fmt: skip
@option("--style", type=click.Choice(["map_server", "paper"]), default="map_server", show_default=True,
        help="A map for robots (map_server), or points and path on white with axes (paper).")  # fmt: skip
@option("--yaml/--no-yaml", default=None,
        help="Write MAP.yaml for map_server and Nav2; one that is there is replaced. Default: for plain maps "
        "only.")  # fmt: skip
@option("--mcap", type=PATH, metavar="OUT.mcap",
        help="Also write map, path, graph and scans for Foxglove and RViz.")  # fmt: skip
@option("--poses", type=PATH, metavar="OUT.tum",
        help="Also write the poses in the frame of the map, in TUM format.")  # fmt: skip
@json_option
@shape_options
@reading_options
@common_options
def command(
    graph_file: str,
    log: tuple[str, ...],
    output: str,
    resolution: float,
    trajectory: bool,
    graph: bool,
    uncertainty: bool,
    compare: bool,
    style: str,
    yaml: bool | None,
    mcap: str | None,
    poses: str | None,
    as_json: bool,
    shape: MapShape,
    reading: ReadingOptions,
    quiet: bool,
    **_verbosity: int,
) -> None:
    """Draw the occupancy map of a graph from the scans of its LOG.

    LOG is read with the options of slam, unless an option here overrides them. The map is an 8-bit gray PNG,
    or a PGM if it is named MAP.pgm, with a YAML for map_server and Nav2. With overlays or --style paper it is
    a colour picture, which robots cannot load, and no YAML is written.

    MAP.html is a page for any browser that needs no other file: the map to zoom and to measure in, the path
    by time, scans, keyframes, relations, loops with the reasons of refused ones, uncertainty and notices.

    --align turns path and graph along with the map, in all that is written; the YAML says by how much.
    --clean makes unknown what was only seen through glass, and frees the places of people who passed and of
    things that most visits did not see. The map is cleaned before it is cropped.

    With --compare, the second result is moved rigidly so that it fits the first best. Walls of both are dark,
    walls of one alone in its colour.

    OUT.mcap is a recording of ROS 2 messages on the topics /map, /path, /graph, /scan, /tf and /tf_static.
    Poses of the result are in the frame map; the other frames are odom, base_link and laser, or as in LOG.
    """
    overlaid = trajectory or graph or uncertainty or style == "paper"
    picture = overlaid or compare
    page = is_page(output)
    if page and (picture or yaml):
        raise WrongUsageError(
            f"{output}: a page shows all of the graph; leave out overlays, --style and --yaml"
        )
    if yaml and picture:
        raise WrongUsageError("--yaml is for plain maps, not for colour pictures; leave one of them out")
    in_file = output != "-" and not is_device(output)
    if yaml and not in_file:
        raise WrongUsageError("--yaml needs a map in a file; give -o MAP.png, or leave out --yaml")
    yaml = in_file and not picture and not page if yaml is None else yaml
    if page:
        check_writable(output)
    elif picture:
        check_suffix(output, output)
        check_writable(output)
    else:
        check_map_outputs(output, yaml, MAP_OR_PAGE_SUFFIXES)
    if in_file:
        check_second_output("-o", output, [graph_file, *log])
    seconds = {"--mcap": mcap, "--poses": poses, "--removed": shape.removed}
    check_second_outputs(seconds, [graph_file, *log, output, yaml_path(output) if yaml else None])
    if shape.removed is not None:
        check_suffix(f"--removed {shape.removed}", shape.removed)
    if as_json and output == "-":
        raise WrongUsageError("--json prints to standard output; give -o MAP.png, too")
    if graph_file == "-" and "-" in log:
        raise WrongUsageError("standard input (-) can be one input only; give the other by its path")
    from nscan_cli.logs.log_files import files_of

    if compare:
        plain = shape == MapShape(False, False, None, None) and not any(seconds.values())
        if overlaid or page or yaml or as_json or not plain:
            raise WrongUsageError(
                "--compare draws one picture of both results; only --resolution goes with it"
            )
        if not log:
            raise WrongUsageError("--compare needs two results: render A.json B.tum LOG --compare")
        draw_comparison((graph_file, log[0]), log[1:], output, resolution, reading, quiet)
        return
    result = load_result(graph_file)
    log = log_of(graph_file, result, log)
    check_second_outputs(seconds, files_of(log))
    whole, scans, nodes, rows, notice = over_log(graph_file, result, log, reading)
    if notice is not None:
        say(f"warning: {notice}", quiet)
    shaped = shaped_map(shape, whole, scans, nodes, rows, resolution)
    grid, whole = shaped.grid, shaped.graph
    if page:
        from nscan_cli.mapping.viewer.viewer_page import viewer_page

        title = base_name(output).rpartition(".")[0]
        write_atomically(output, viewer_page(title, grid, whole, scans, nodes, rows))
    elif picture:
        from nscan_cli.mapping.figures.canvas import figure_png
        from nscan_cli.mapping.figures.map_plots import Overlays, plot_over_map, plot_paper_figure

        if uncertainty and not whole.marginals:
            say(f"warning: {graph_file} has no covariances, so no uncertainty is drawn", quiet)
        overlays = Overlays(trajectory, graph, uncertainty)
        if style == "paper":
            canvas = plot_paper_figure(scans, rows, whole.poses[nodes], grid, whole, overlays)
        else:
            canvas = plot_over_map(grid, whole, overlays)
        write_atomically(output, figure_png(canvas.image()))
    else:
        from nscan_cli.mapping.map_server import map_image

        write_map(output, map_image(grid), yaml, quiet, shaped.comments())
    if mcap is not None:
        from nscan_cli.exports.mcap import ros2_recording

        write_atomically(mcap, ros2_recording(scans, rows, nodes, whole, grid))
    if poses is not None:
        from nscan_cli.graph.io.tum import write_tum

        write_atomically(poses, write_tum(whole.stamps, whole.poses))
    if as_json:
        print_json(shaped.facts(output, len(rows)))
    elif output != "-":
        low_x, low_y, high_x, high_y = grid.bounds
        size = f"{high_x - low_x:.1f} m × {high_y - low_y:.1f} m"
        files = f"{output} and {yaml_path(output)}" if yaml else output
        say(f"{files}: {size} from {counted(len(rows), 'scan')}", quiet)
