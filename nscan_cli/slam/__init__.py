"""The SLAM loop (paper, V)."""
