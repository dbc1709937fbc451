"""The stages of a picture, whose time is told."""

CULL, PROJECT, ORDER, DRAW, WAIT = range(5)
"""In ticks that kernels add up; waiting for other threads is no stage."""

TIMES = 5

STAGES = ("cull", "project", "order", "draw")
