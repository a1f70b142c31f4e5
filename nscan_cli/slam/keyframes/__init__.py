"""Step 2 of the loop: keyframes and the path between them (paper, V)."""
