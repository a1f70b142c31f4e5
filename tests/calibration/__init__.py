"""Scans against their file."""
