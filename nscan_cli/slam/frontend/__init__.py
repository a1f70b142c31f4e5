"""Step 1 of the loop: scans tracked against the map of the last metres (paper, V)."""
