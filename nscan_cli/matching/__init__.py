"""Poses ← scans: pairwise and joint matching (paper, III)."""
