"""Splats near an eye, cut into smaller ones."""
