"""Rims as sharp as the surface itself: discs stand over free edges."""
