"""Pieces of lists: their splats taken, projected and put in order."""
