"""Splats of a tile dealt out to its squares."""
