"""The style sheet and the script of the viewer. A report that is up to date needs no more, and no NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SCRIPTS = ("unpack.js", "camera.js", "layers.js", "controls.js", "viewer.js")


@dataclass(frozen=True)
class ViewerParts:
    """What a page needs once, however many viewers it has."""

    style: str
    script: str


def viewer_parts() -> ViewerParts:
    """The style sheet and the script."""
    beside = Path(__file__).parent
    scripts = "\n".join((beside / name).read_text("utf-8") for name in SCRIPTS)
    style = (beside / "viewer.css").read_text("utf-8")
    return ViewerParts(style, f'"use strict";\n(() => {{\n{scripts}}})();')
