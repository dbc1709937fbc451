"""Packets of rays that integrate between samples."""
