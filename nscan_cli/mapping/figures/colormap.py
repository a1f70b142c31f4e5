"""The colour map plasma, from dark blue over purple to orange, whose order the colour-blind see too."""

from __future__ import annotations

import numpy as np

from nscan_cli.mapping.figures.canvas import Colour

# S. van der Walt, N. Smith, "plasma" (CC0), without its lightest fifth, which is hard to see on white.
PLASMA = np.array(
    [
        (13, 8, 135),
        (84, 2, 163),
        (139, 10, 165),
        (185, 50, 137),
        (219, 92, 104),
        (244, 136, 73),
        (252, 166, 54),
    ]
)


def plasma(count: int) -> list[Colour]:
    """`count` evenly spaced colours."""
    at = np.linspace(0, len(PLASMA) - 1, count)
    channels = [np.interp(at, np.arange(len(PLASMA)), channel) for channel in PLASMA.T]
    return [(red, green, blue) for red, green, blue in np.round(channels).astype(int).T.tolist()]
