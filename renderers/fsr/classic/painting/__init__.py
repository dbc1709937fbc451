"""Compiled lighting of splats."""
