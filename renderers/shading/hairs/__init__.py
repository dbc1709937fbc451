"""Hairs of the vestibule: where they grow, and how they are drawn."""
