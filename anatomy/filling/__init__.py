"""Filling a lattice with what a head is at its points."""
