"""Repeated maps of one drive that must agree: how far a result can be trusted without ground truth."""
