"""Scenes drawn by VTK."""
