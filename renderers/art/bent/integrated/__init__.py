"""Bent rays whose samples are the ends of segments."""
