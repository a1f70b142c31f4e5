"""An evaluation as a picture: where the result is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nscan_cli.evaluation.evaluation_report import Evaluation
from nscan_cli.mapping.figures.canvas import Canvas
from nscan_cli.mapping.figures.error_plots import plot_against_reference, plot_relations
from nscan_cli.mapping.figures.panels import bounds_around, is_wide, stack_images
from nscan_cli.poses import compose

if TYPE_CHECKING:
    from PIL.Image import Image


def picture(evaluation: Evaluation, worst: int) -> Image:
    """The `worst` relations over the result, and the result over the reference: what there is of both."""
    panels, result = list[Canvas](), evaluation.trajectory
    both = evaluation.relations is not None and evaluation.reference is not None
    beside = both and not is_wide(bounds_around(result.poses[:, :2]))
    if evaluation.relations:
        table, errors = evaluation.relations
        shown = errors.worst(worst)
        of_worst = np.column_stack([errors.translation[shown], errors.rotation[shown]])
        metres, degrees = errors.translation_spread, errors.rotation_spread
        title = (
            f"{evaluation.result} on {table.name}: mean error {metres.mean:.4f} ± {metres.sd:.4f} m, "
            f"{degrees.mean:.2f} ± {degrees.sd:.2f}°"
        )
        panels.append(plot_relations(result.poses, errors.rows[shown], of_worst, title, beside))
    if evaluation.reference:
        name, truth, against = evaluation.reference
        metres = against.absolute_translation
        title = (
            f"{evaluation.result} on {name}: mean error {metres.mean:.4f} ± {metres.sd:.4f} m, "
            f"RMSE {metres.rmse:.4f} m"
        )
        aligned = compose(against.alignment.motion, result.poses)
        panels.append(
            plot_against_reference(aligned, against.rows, against.translation, truth.poses, title, beside)
        )
    return stack_images([panel.image() for panel in panels], beside)
