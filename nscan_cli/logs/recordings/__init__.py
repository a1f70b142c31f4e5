"""Recordings of messages: MCAP and ROS bags."""
