"""Compiled clipping of sparse rows and their order from the eye."""
