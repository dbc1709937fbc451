"""Shells of elements taken sixteen at a time."""
