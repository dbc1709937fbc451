"""Rays bent by deflectors: the tissue is deformed, the volume stays as it is."""

from renderers.art.bent.march import BentMarch

__all__ = ["BentMarch"]
