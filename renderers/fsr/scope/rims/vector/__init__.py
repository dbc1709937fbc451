"""Rims asked sixteen rays at a time."""
