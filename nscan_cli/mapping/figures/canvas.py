"""A canvas with coordinates in metres: anti-aliased lines, discs, ellipses, point clouds and text.

Widths, radii and sizes of text are in units. A unit is a thousandth of the longer side of the plot, so that
a picture looks the same at any number of pixels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.map_server import png_bytes
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

Colour = tuple[int, ...]
"""Red, green, blue and, if it is not 255, opacity; each 0..255."""
Bounds = tuple[float, float, float, float]
"""The least x, least y, greatest x and greatest y, m."""
Margins = tuple[float, float, float, float]
"""Left, top, right and bottom, units."""

# M. Okabe, K. Ito, "Color Universal Design": the colour-blind can tell these colours apart.
SKY, GREEN = (86, 180, 233), (0, 158, 115)
BLUE, VERMILLION, PURPLE = (0, 114, 178), (213, 94, 0), (204, 121, 167)
BLACK, GRAY, WHITE = (20, 20, 20), (110, 110, 110), (255, 255, 255)

SUPERSAMPLING = 3
"""Every pixel is the mean of SUPERSAMPLING × SUPERSAMPLING samples."""
BAND_ROWS = 240
"""Number of rows of pixels drawn at a time. Fewer take less memory."""
TEXT_SIZE = 17.0
"""Units."""
LINE_CORNERS = 32
"""Number of corners of the pieces into which long lines are divided."""
ELLIPSE_CORNERS = 48
"""Number of corners of the polygon of an ellipse."""
DOT_CORNERS = 12
"""Number of corners of the polygon of a small dot."""
DPI = 300
"""Dots an inch of figures: a plot of 2400 pixels is printed 20 cm long, with text of 10 points."""


def figure_png(picture: Image) -> bytes:
    """A figure as a PNG file for print at DPI."""
    return png_bytes(picture, DPI)


@dataclass(frozen=True)
class Band:
    """Rows of the picture, enlarged SUPERSAMPLING times, while they are drawn."""

    pen: ImageDraw
    top: int
    rows: int

    def samples(self, pixels: Array) -> Array:
        """Positions (…, 2) in the picture as whole samples in the enlarged band."""
        # Pillow truncates, which rounds differently above a band and within it.
        whole: Array = np.floor((pixels - np.array([0, self.top])) * SUPERSAMPLING + 0.5)
        return whole

    def reached_by(self, shapes: Array, spare: float) -> Array:
        """The shapes (N, corners, 2) that come within `spare` pixels of the band, in samples."""
        low, high = shapes[..., 1].min(axis=1) - spare, shapes[..., 1].max(axis=1) + spare
        return self.samples(shapes[(low <= self.top + self.rows) & (high >= self.top)])


class Canvas:
    """A plot of `bounds`; it keeps strokes in their order until `image` draws them."""

    def __init__(
        self,
        bounds: Bounds,
        pixels_per_metre: float,
        background: NDArray[np.uint8] | None = None,
        margins: Margins = (0, 0, 0, 0),
        scale: float = 1.0,
    ) -> None:
        """A white plot, or one with a gray `background` (h, w) that covers the bounds, within margins.

        `scale` enlarges the unit for a panel that is a part of a picture.
        """
        self.bounds = bounds
        self.pixels_per_metre = pixels_per_metre
        if background is None:
            width = math.ceil((bounds[2] - bounds[0]) * pixels_per_metre)
            height = math.ceil((bounds[3] - bounds[1]) * pixels_per_metre)
            background = np.full((height, width), 255, dtype=np.uint8)
        height, width = background.shape
        self.unit = scale * max(width, height) / 1000
        """Size of a unit, pixels."""
        left, top, right, bottom = (round(margin * self.unit) for margin in margins)
        self.plot = (left, top, left + width, top + height)
        """Left, top, right and bottom edge of the plot, pixels."""
        self.size = (left + width + right, top + height + bottom)
        """Width and height with margins, pixels."""
        self._pixels = np.full((self.size[1], self.size[0], 3), 255, dtype=np.uint8)
        self._pixels[top : top + height, left : left + width] = background[..., None]
        self._strokes: list[Callable[[Band], None]] = []

    @classmethod
    def blank(
        cls, bounds: Bounds, longest: int, margins: Margins = (0, 0, 0, 0), scale: float = 1.0
    ) -> Canvas:
        """A white plot whose longer side has `longest` pixels."""
        pixels_per_metre = longest / max(bounds[2] - bounds[0], bounds[3] - bounds[1])
        return cls(bounds, pixels_per_metre, None, margins, scale)

    def pixels(self, points: Array) -> Array:
        """Points (…, 2) in metres as positions (…, 2) in the picture, pixels from its upper left corner."""
        left, _top, _right, bottom = self.plot
        x = left + (points[..., 0] - self.bounds[0]) * self.pixels_per_metre
        y = bottom - (points[..., 1] - self.bounds[1]) * self.pixels_per_metre
        return np.stack([x, y], axis=-1)

    def line(self, points: Array, colour: Colour, width: float = 2.0) -> None:
        """Draws a line through the points (N, 2), m."""
        corners = self.pixels(points)
        # Points where the robot stands still are left out.
        moved = np.any(np.diff(np.round(2 * corners), axis=0) != 0, axis=1)
        corners = corners[np.concatenate([[True], moved])]
        # Each band then draws few pieces. They overlap, so that every corner lies inside a piece.
        pieces = [corners[k : k + LINE_CORNERS] for k in range(0, max(1, len(corners) - 2), LINE_CORNERS - 2)]
        pieces[-1] = np.pad(pieces[-1], ((0, LINE_CORNERS - len(pieces[-1])), (0, 0)), mode="edge")
        self.pixel_lines(np.stack(pieces), colour, width)

    def segments(self, starts: Array, ends: Array, colour: Colour, width: float = 1.0) -> None:
        """Draws straight lines from `starts` (N, 2) to `ends` (N, 2), m."""
        self.pixel_lines(np.stack([self.pixels(starts), self.pixels(ends)], axis=1), colour, width)

    def circles(self, centres: Array, radius: float, colour: Colour, ring: Colour | None = None) -> None:
        """Draws discs of `radius` units at the points (N, 2), m, with an optional `ring` around each."""
        self.pixel_ovals(self.pixels(centres), np.array([radius, radius]), colour, ring)

    def dots(self, points: Array, radius: float, colour: Colour) -> None:
        """Draws small discs of `radius` units at the points (N, 2), m, that lie in the plot."""
        low, high = np.array(self.bounds[:2]), np.array(self.bounds[2:])
        inside = points[np.all((points >= low) & (points <= high), axis=1)]
        self.pixel_ovals(self.pixels(inside), np.array([radius, radius]), colour, corners=DOT_CORNERS)

    def ellipses(self, centres: Array, covariances: Array, sigmas: float, colour: Colour) -> None:
        """Draws ellipses of `sigmas` standard deviations of covariances (N, 2, 2), m², around (N, 2), m."""
        angles = np.linspace(0, 2 * np.pi, ELLIPSE_CORNERS, endpoint=False)
        circle = np.stack([np.cos(angles), np.sin(angles)])
        values, vectors = np.linalg.eigh(covariances)
        axes = vectors * np.sqrt(np.maximum(values, 0))[:, None, :]
        outlines = self.pixels(centres[:, None, :] + sigmas * np.swapaxes(axes @ circle, 1, 2))
        self._ovals(outlines, colour, (*colour[:3], 60))

    def cloud(self, points: Array, colour: Colour, opacity: float = 0.5) -> None:
        """Draws a point cloud (N, 2), m, beneath all strokes; more points make a pixel less transparent."""
        left, top, right, bottom = self.plot
        x, y = np.moveaxis(np.floor(self.pixels(points)).astype(np.int64), -1, 0)
        inside = (x >= left) & (x < right) & (y >= top) & (y < bottom)
        width, height = self.size
        counts = np.bincount(y[inside] * width + x[inside], minlength=width * height)
        dotted = np.flatnonzero(counts)
        paper = ((1 - opacity) ** counts[dotted])[:, None]
        pixels = self._pixels.reshape(-1, 3)
        mixed = paper * pixels[dotted] + (1 - paper) * np.array(colour[:3])
        pixels[dotted] = np.round(mixed).astype(np.uint8)

    def pixel_lines(self, lines: Array, colour: Colour, width: float) -> None:
        """Draws lines (N, corners, 2), each through its corners, in pixels."""
        pixel_width = max(1.0, width * self.unit)

        def stroke(band: Band) -> None:
            for line in band.reached_by(lines, pixel_width):
                corners = line.ravel().tolist()
                band.pen.line(corners, fill=colour, width=round(pixel_width * SUPERSAMPLING), joint="curve")

        self._strokes.append(stroke)

    def pixel_ovals(
        self,
        centres: Array,
        radii: Array,
        colour: Colour,
        ring: Colour | None = None,
        corners: int = ELLIPSE_CORNERS,
    ) -> None:
        """Draws ovals at (N, 2) in pixels; `radii` (2,) are along the axes of the picture, in units."""
        angles = np.linspace(0, 2 * np.pi, corners, endpoint=False)
        circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * radii * self.unit
        self._ovals(centres[:, None, :] + circle, ring, colour)

    def clear_margins(self) -> None:
        """Paints the margins white, over strokes that reach beyond the plot."""
        left, top, right, bottom = self.plot
        width, height = self.size
        sides = (
            (0, 0, width, top),
            (0, bottom, width, height),
            (0, 0, left, height),
            (right, 0, width, height),
        )
        corners = [[[a, b], [c, b], [c, d], [a, d]] for a, b, c, d in sides]
        self._ovals(np.array(corners, dtype=np.float64), None, WHITE)

    def text(
        self, place: tuple[float, float], text: str, anchor: str = "lm", size: float = TEXT_SIZE
    ) -> None:
        """Draws text at a place in pixels; `anchor` is one of Pillow's.

        The font of Pillow has a part of Latin-1 only: ° and ±, but no ×, ², Greek letters or minus sign.
        """
        font = self._font(size)

        def stroke(band: Band) -> None:
            x, y = band.samples(np.array(place)).tolist()
            band.pen.text((x, y), text, fill=BLACK, font=font, anchor=anchor)

        self._strokes.append(stroke)

    def text_width(self, text: str, size: float = TEXT_SIZE) -> float:
        """Width of a text, pixels."""
        return self._font(size).getlength(text) / SUPERSAMPLING

    def image(self) -> Image:
        """The picture in RGB."""
        from PIL import Image, ImageDraw

        width, height = self.size
        picture = Image.new("RGB", (width, height))
        for top in range(0, height, BAND_ROWS):
            pixels = self._pixels[top : top + BAND_ROWS]
            enlarged = Image.fromarray(pixels).resize(
                (width * SUPERSAMPLING, len(pixels) * SUPERSAMPLING), Image.Resampling.NEAREST
            )
            # In this mode, Pillow blends colours by their opacity.
            band = Band(ImageDraw.Draw(enlarged, "RGBA"), top, len(pixels))
            for stroke in self._strokes:
                stroke(band)
            picture.paste(enlarged.reduce(SUPERSAMPLING), (0, top))
        return picture

    def _ovals(self, outlines: Array, ring: Colour | None, inside: Colour) -> None:
        """Draws polygons (N, corners, 2) in pixels."""

        def stroke(band: Band) -> None:
            width = max(SUPERSAMPLING, round(1.2 * self.unit * SUPERSAMPLING))
            for outline in band.reached_by(outlines, width):
                corners = outline.ravel().tolist()
                band.pen.polygon(corners, fill=inside)
                if ring is not None:
                    band.pen.line(corners + corners[:4], fill=ring, width=width)

        self._strokes.append(stroke)

    def _font(self, size: float) -> FreeTypeFont:
        from PIL import ImageFont

        font = ImageFont.load_default(size * self.unit * SUPERSAMPLING)
        assert isinstance(font, ImageFont.FreeTypeFont)
        return font
