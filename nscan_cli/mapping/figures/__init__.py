"""Pictures: drawing on a canvas, axes, plots."""
