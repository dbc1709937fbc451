"""Rays bent by deflectors: the tissue is deformed, the volume stays as it is."""

from renderers.art.bent.march import BENT_PROBLEM, BentMarch

__all__ = ["BENT_PROBLEM", "BentMarch"]
