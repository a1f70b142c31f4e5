"""Poses and scans → maps and pictures."""
