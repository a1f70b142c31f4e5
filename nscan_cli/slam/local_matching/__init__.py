"""Step 3 of the loop: keyframes matched with those near them (paper, V)."""
