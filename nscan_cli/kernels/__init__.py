"""Compiled code: which functions are kernels, and how their machine code is kept and loaded."""
