"""Cones sixteen at a time."""
