"""The plain ray caster that both renderers are judged by."""

from renderers.reference.caster import box_interval, render_reference, sobel_gradient
from renderers.reference.quadrature import gauss_ray, kinks

__all__ = ["box_interval", "gauss_ray", "kinks", "render_reference", "sobel_gradient"]
