"""`render --compare`: the maps of two results of one log over each other."""

from __future__ import annotations

from nscan_cli.cli.progress import say
from nscan_cli.cli.result_over_log import load_result, log_of, number_by_order, over_log
from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.inputs import base_name, label
from nscan_cli.files.outputs import write_atomically
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions


def draw_comparison(
    results: tuple[str, str], log: tuple[str, ...], output: str, resolution: float, reading: ReadingOptions,
    quiet: bool,
) -> None:  # fmt: skip
    """Draw both maps; the second result is moved rigidly so that its scans lie best on those of the first."""
    if "-" in (*results, *log):
        raise WrongUsageError("--compare reads files; standard input (-) can be none of them")
    import numpy as np

    from nscan_cli.evaluation.alignment import alignment
    from nscan_cli.mapping.figures.canvas import figure_png
    from nscan_cli.mapping.figures.map_plots import DrawnResult, plot_comparison
    from nscan_cli.mapping.occupancy import occupancy_grid
    from nscan_cli.poses import compose

    loaded = [load_result(path) for path in results]
    log = log or log_of(results[0], loaded[0], log)
    notices = [number_by_order(results[k], loaded[k], results[1 - k], loaded[1 - k]) for k in range(2)]
    first, second = (
        over_log(path, result, log, reading) for path, result in zip(results, loaded, strict=True)
    )
    for notice in filter(None, (*notices, first.notice, second.notice)):
        say(f"warning: {notice}", quiet)
    _, one, two = np.intersect1d(first.rows, second.rows, return_indices=True)
    if len(one) == 0:
        raise InputDataError(label(results[1]), f"has no scan that {results[0]} has", "compare others")
    truth, moved = first.graph.poses[first.nodes[one]], second.graph.poses[second.nodes[two]]
    motion = alignment(moved, truth).motion
    apart = np.hypot(*(compose(np.broadcast_to(motion, moved.shape), moved) - truth)[:, :2].T)
    drawn = []
    for path, result, frame in ((results[0], first, np.zeros(3)), (results[1], second, motion)):
        poses = result.graph.poses[result.nodes]
        poses = compose(np.broadcast_to(frame, poses.shape), poses)
        grid = occupancy_grid(result.log, result.rows, poses, resolution)
        drawn.append(DrawnResult(base_name(path), grid, poses[:, :2]))
    write_atomically(output, figure_png(plot_comparison(*drawn).image()))
    scan = int(first.graph.scans[first.nodes[one[int(np.argmax(apart))]]])
    say(
        f"{output}: {results[1]} is off {results[0]} by {np.sqrt((apart**2).mean()):.3f} m (RMS), at most "
        f"{apart.max():.3f} m at scan {scan}, in {counted(len(one), 'common scan')}",
        quiet,
    )
