"""Bytes in and out: reading inputs within limits, writing outputs atomically, and provenance."""
