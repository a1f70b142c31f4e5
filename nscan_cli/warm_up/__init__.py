"""Kernels compiled before they are needed, in two processes side by side."""
