"""Splats composited sixteen pixels at a time."""
