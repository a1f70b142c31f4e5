"""Scans → Gaussians: the normal distributions transform."""
