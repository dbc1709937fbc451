"""Compiled code of the one shading and of its camera."""
