"""Probe paths: recorded, kept in files, played."""
