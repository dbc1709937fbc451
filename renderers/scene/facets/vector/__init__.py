"""Triangles met by eight rays at a time."""
