"""Splats projected sixteen at a time."""
