"""Compiled code of the Fuzzy-Set Renderer."""
