"""Laser logs: each form has a reader, found by the content of the file."""
