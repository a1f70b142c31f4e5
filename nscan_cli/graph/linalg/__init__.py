"""Sparse matrices of 3 × 3 blocks: what SciPy does not have."""
