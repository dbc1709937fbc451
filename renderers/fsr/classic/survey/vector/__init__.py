"""Rows clipped and surveyed sixteen at a time."""
