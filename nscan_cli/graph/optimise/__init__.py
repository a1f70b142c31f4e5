"""The energy of a graph and its minimum (paper, IV)."""
