"""Surfels projected sixteen at a time."""
