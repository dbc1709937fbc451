"""Triangles drawn through a lens."""
