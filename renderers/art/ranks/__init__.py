"""Ranks: nodes that share cells or rays, and what carries their messages."""
