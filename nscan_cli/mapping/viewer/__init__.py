"""The map as a page for browsers: to zoom, to measure, and to look at scans, loops and notices."""
