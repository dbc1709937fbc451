"""Taps whose four channels are worked on at once."""
