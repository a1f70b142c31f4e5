"""Steps 5 and 6 of the loop: the graph optimised and refined (paper, V)."""
