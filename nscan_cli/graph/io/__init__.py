"""Graphs and trajectories as files."""
