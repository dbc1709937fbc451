"""Exercises: whether they fit a head, the way into it, and who makes them."""
