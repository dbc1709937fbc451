"""Compiled parts of what mucosa was seen."""
