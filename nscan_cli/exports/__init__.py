"""Poses and scans in the forms that other tools read."""
