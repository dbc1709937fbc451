"""Compiled projection of surface elements into the picture."""
