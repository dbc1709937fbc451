"""Pieces projected sixteen splats at a time."""
