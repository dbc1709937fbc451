"""Rims and faces of cuts as sharp as a ray sees them."""
