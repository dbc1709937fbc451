"""Surfels drawn and projected sixteen lanes at a time."""
