"""Noise octaves and vessels on the surface."""
