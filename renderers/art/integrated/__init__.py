"""Rays that integrate a transfer function between samples."""

from renderers.art.integrated.march import IntegratedMarch

__all__ = ["IntegratedMarch"]
