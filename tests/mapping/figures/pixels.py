"""The pixels of a picture, and their colours."""

from __future__ import annotations

import numpy as np
from PIL.Image import Image

from nscan_cli.mapping.figures.canvas import Canvas


def pixels(picture: Canvas | Image) -> np.ndarray:
    """(H, W, 3)"""
    found: np.ndarray = np.asarray(picture.image() if isinstance(picture, Canvas) else picture).astype(int)
    return found


def close_to(picture: np.ndarray, colour: tuple[int, ...], most: int = 3) -> np.ndarray:
    """Where pixels (H, W, 3) are about of a colour."""
    close: np.ndarray = np.abs(picture - np.array(colour[:3])).max(axis=-1) <= most
    return close


def count(picture: np.ndarray, colour: tuple[int, ...]) -> int:
    """How many pixels have exactly this colour."""
    return int(np.count_nonzero((picture == colour).all(axis=-1)))
