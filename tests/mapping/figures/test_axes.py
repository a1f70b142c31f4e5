"""Axes and legends where there is little room for them."""

from __future__ import annotations

import pytest

from nscan_cli.mapping.figures.axes import CAPTION_MARGINS, FOOTER_MARGINS, caption, footer
from nscan_cli.mapping.figures.canvas import BLUE, Canvas
from tests.mapping.figures.test_canvas import pixels

ENTRIES = [("line", BLUE, "path"), ("disc", BLUE, "keyframes")]


@pytest.mark.parametrize("height", [3.0, 400.0, 9000.0])
def test_a_map_that_is_far_too_high_for_its_width_has_no_text_and_is_drawn(height):
    """A pose that is kilometres off makes one: letters would have less than no size."""
    bounds = (0.0, 0.0, 4.0, height)
    for margins, draw in ((FOOTER_MARGINS, footer), (CAPTION_MARGINS, lambda c, e: caption(c, "title", e))):
        canvas = Canvas(bounds, 1200 / height, margins=margins)
        draw(canvas, ENTRIES)
        assert pixels(canvas).shape[:2] == canvas.size[::-1]
