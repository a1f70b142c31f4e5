"""Block Cholesky factorisation and selected inverse of sparse matrices, which SciPy lacks."""
