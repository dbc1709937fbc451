"""Compiled code of the Active Ray Tracer."""
