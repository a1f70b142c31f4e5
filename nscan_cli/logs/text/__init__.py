"""Logs that are lines of text."""
