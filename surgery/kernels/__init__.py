"""Compiled loops of surgery."""
