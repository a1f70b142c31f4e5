"""nscan-cli: 2D laser logs to globally consistent maps by nScan-Matching (Biber & Straßer 2006)."""

__version__ = "0.1.0"
