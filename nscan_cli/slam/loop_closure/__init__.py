"""Step 4 of the loop: places seen before, by search (paper, V)."""
