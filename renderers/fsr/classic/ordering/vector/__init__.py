"""Tile lists made sixteen splats at a time."""
