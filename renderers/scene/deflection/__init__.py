"""Tissue moved where it is looked at: the vocabulary of deformation.

A deflector bends sight rays (Kurzion and Yagel, Volume deformation using ray
deflectors, Eurographics Workshop on Rendering 1995): at a place x of the picture one
sees what the undeformed tissue has at ``q(x)``, its pull-back. A renderer that samples
along rays asks for q; one that draws elements of tissue needs the inverse, where an
element at q appears. Both are here, so that they cannot disagree.

Each acts within a ball, by the weight ``w(s) = (1 - s^2)^2`` of the distance from its
centre in radii: one at the centre, zero from the rim on, smooth at both. Beyond a
certain strength a map folds and tissue would appear twice; that is refused. Extinction
is the object's at q over lengths at x: a uniform medium stays what it is, and is not
squeezed. All points are ``(n, 3)`` float64, world, mm.
"""

from renderers.scene.deflection.chain import Deflection, maps_of
from renderers.scene.deflection.deflector import Deflector, FoldError
from renderers.scene.deflection.kinds import Cut, Rotation, Scaling, Translation
from renderers.scene.deflection.resampling import (
    deflected_distance,
    deflected_scene,
    deflected_surface,
    deflected_volume,
)

__all__ = [
    "Cut",
    "Deflection",
    "Deflector",
    "FoldError",
    "Rotation",
    "Scaling",
    "Translation",
    "deflected_distance",
    "deflected_scene",
    "deflected_surface",
    "deflected_volume",
    "maps_of",
]
