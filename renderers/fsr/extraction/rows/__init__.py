"""Fuzzy sets taken from a volume, row by row."""
