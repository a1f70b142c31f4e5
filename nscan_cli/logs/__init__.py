"""FileBytes → scans: one reader a format, found from the content."""
