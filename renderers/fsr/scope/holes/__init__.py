"""Pixels that no disc covers although their neighbours are covered."""
