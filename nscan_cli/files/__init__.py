"""Bytes in and out: inputs and outputs whole or not at all, their limits, what a result was made from."""
