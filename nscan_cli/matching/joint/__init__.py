"""nScan-Matching: n scans matched jointly (paper, III)."""
