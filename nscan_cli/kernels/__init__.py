"""Compiled code: the decorators of kernels, and the cache of their machine code."""
