"""Compiled: the force loop, its clock, and devices' functions by their addresses."""
