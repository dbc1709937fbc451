"""Compiled code of the scenarios."""
