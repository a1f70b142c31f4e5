"""Axes and legends where there is little room for them."""

from __future__ import annotations

import pytest

from nscan_cli.mapping.figures.axes import (
    SCALE_BAR_MARGINS,
    TITLE_MARGINS,
    draw_scale_bar,
    draw_title_and_legend,
)
from nscan_cli.mapping.figures.canvas import BLUE, Canvas
from tests.mapping.figures.pixels import pixels

ENTRIES = [("line", BLUE, "path"), ("disc", BLUE, "keyframes")]


@pytest.mark.parametrize("height", [3.0, 400.0, 9000.0])
def test_a_map_that_is_far_too_high_for_its_width_has_no_text_and_is_drawn(height):
    """A pose that is kilometres off makes one: letters would have less than no size."""
    bounds = (0.0, 0.0, 4.0, height)
    for margins, draw in (
        (SCALE_BAR_MARGINS, draw_scale_bar),
        (TITLE_MARGINS, lambda c, e: draw_title_and_legend(c, "title", e)),
    ):
        canvas = Canvas(bounds, 1200 / height, margins=margins)
        draw(canvas, ENTRIES)
        assert pixels(canvas).shape[:2] == canvas.size[::-1]
