"""The worker process, started by `bootstrap.py`: map one log and measure its errors.

It does what `slam` with --map and --trajectory does, and then `evaluate`. It prints its progress as lines of
JSON, and exits when its standard input is closed, since its parent has then ended.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nscan_cli.errors import NscanError
from nscan_cli.nightly.task import OUTPUTS, RESULT, TASK, reading_options_from

REPORT_INTERVAL = 0.2
"""Least time between two lines of progress, s."""


def main(place: str) -> None:
    """Run the task in a workspace, and write its outputs and its result there."""
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    os.chdir(place)
    try:
        result = map_and_evaluate(json.loads(Path(TASK).read_bytes()), Path(OUTPUTS), _progress_printer())
    except NscanError as error:
        result = {"reason": str(error)}
    except OSError as error:
        result = {"reason": f"cannot write the results: {error.strerror or error}"}
    except MemoryError:
        result = {"reason": "out of memory"}
    except Exception as error:
        traceback.print_exc()
        result = {"reason": f"internal error, please report it: {type(error).__name__}: {error}"}
    Path(RESULT).write_text(json.dumps(result, allow_nan=False))


def map_and_evaluate(
    task: dict[str, Any], outputs: Path, report: Callable[[int, int, int], None]
) -> dict[str, Any]:
    """Map and evaluate a log; returns the counts, the evaluation and the times. Raises the errors of both.

    The time is None if kernels were compiled during the run.
    """
    import numpy as np

    from nscan_cli.graph.io.json_graph import write_graph
    from nscan_cli.graph.io.tum import write_tum
    from nscan_cli.kernels.cache_folder import cache_folder
    from nscan_cli.logs.load import read_log
    from nscan_cli.mapping.map_server import map_image, map_png, map_yaml
    from nscan_cli.mapping.occupancy import occupancy_grid
    from nscan_cli.mapping.viewer.viewer_page import embedded_viewer, viewer_page
    from nscan_cli.slam.consistency.map_verification import add_verification
    from nscan_cli.slam.consistency.options import VerificationOptions
    from nscan_cli.slam.log_to_graph import GraphCounts, map_log, notices_of_mapping, slam_options
    from nscan_cli.warm_up import kernel_exercises, side_by_side

    if cache_folder() is None:
        for share in kernel_exercises.FOR_ALL:
            kernel_exercises.main(*share)
    kept, began = side_by_side.cached_files(), time.perf_counter()
    reading, mapping = reading_options_from(task["reading"]), task["mapping"]
    options = slam_options(
        mapping.get("max-scans"), mapping.get("relations"), not mapping.get("no-loops", False)
    )
    log = read_log(task["inputs"]["log"], reading)
    state, graph = map_log(
        log,
        reading,
        options,
        task["threads"],
        lambda done, keyframes, _accepted: report(done, len(log), keyframes),
    )
    bound = mapping.get("verify-bound")
    if bound is not None:
        add_verification(state, graph, VerificationOptions(bound=bound), task["threads"])
    # As the check of the file has corrected it.
    log, rows = dataclasses.replace(state.recorded, mapped_path=graph.path), np.arange(len(log))
    grid = occupancy_grid(log, rows, graph.poses)
    (outputs / "graph.json").write_bytes(write_graph(graph))
    (outputs / "trajectory.tum").write_bytes(write_tum(graph.stamps, graph.poses))
    image = map_image(grid)
    (outputs / "map.png").write_bytes(map_png(image))
    (outputs / "map.yaml").write_bytes(map_yaml("map.png", image))
    seconds: float | None = round(time.perf_counter() - began, 3)
    if "numba" in sys.modules and side_by_side.cached_files() - kept:
        # Cached code is loaded without numba, so new files of the cache were compiled during this run.
        seconds = None
    (outputs / "map.html").write_bytes(
        viewer_page(Path(task["inputs"]["log"]).name, grid, graph, log, rows, rows)
    )
    (outputs / "viewer.html").write_bytes(embedded_viewer(Path(task["inputs"]["log"]).name, grid, graph))
    made = GraphCounts.of(graph)
    counts = {
        "scans": len(log),
        "duration": round(float(log.times[-1] - log.times[0]), 3),
        "keyframes": made.keyframes,
        "pairwise": made.pairwise,
        "nscan": made.nscan,
        "loops": {"accepted": made.accepted, "refused": made.refused.total()},
        "warnings": log.report.notices() + notices_of_mapping(log, graph),
    }
    if bound is not None:
        counts["verification"] = {"greatest": graph.provenance["verification"]["greatest"], "bound": bound}
    evaluation = _evaluation(task["inputs"], str(outputs / "graph.json"))
    return {"counts": counts, "evaluation": evaluation, "times": {"seconds": seconds}}


def _evaluation(inputs: dict[str, str], graph_file: str) -> dict[str, Any] | None:
    """The document of `evaluate --json` for the graph; None without relations or a reference."""
    from nscan_cli.evaluation.evaluate_result import evaluate_result
    from nscan_cli.evaluation.evaluation_report import as_document

    relations, reference = inputs.get("relations"), inputs.get("reference")
    if relations is None and reference is None:
        return None
    return as_document(evaluate_result(graph_file, relations, reference))


def _progress_printer() -> Callable[[int, int, int], None]:
    """A function that prints the progress, at most once in REPORT_INTERVAL."""
    next_time = 0.0

    def report(done: int, total: int, keyframes: int) -> None:
        nonlocal next_time
        if done < total and time.monotonic() < next_time:
            return
        next_time = time.monotonic() + REPORT_INTERVAL
        print(json.dumps([done, total, keyframes]), flush=True)

    return report


def _exit_with_parent() -> None:
    with contextlib.suppress(OSError):
        while os.read(0, 1024):
            pass
    os._exit(1)
