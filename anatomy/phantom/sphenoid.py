"""The sphenoid sinus of one side, moulded by the optic nerve and the carotid."""

import numpy as np

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import (
    Affine,
    Chain,
    Ellipsoid,
    Field,
    depth_table,
    height_table,
    smooth_max,
    u,
    y,
    z,
)
from anatomy.phantom.vessels import CANAL_WALL_MM, internal_carotid, optic_nerve
from anatomy.tissue import Side


def intersphenoid_shift(parameters: PhantomParameters) -> float:
    """Draw how far the septum of the sphenoid leaves the midline behind, mm."""
    rng = np.random.default_rng([parameters.seed, 0x7370])
    return float(np.clip(rng.normal(0.0, 1.6), -3.5, 3.5))


def sphenoid(parameters: PhantomParameters, side: Side) -> Field:
    """Build the sphenoid sinus: six blended walls, less nerve, artery, Onodi cell.

    Its roof is the planum in front and falls below the sella behind; its septum
    leaves the midline towards the rear, so the two sinuses differ.
    """
    w = parameters.scale("sphenoid", side)
    depth, wide, high = 20.3 * w, 14.8 * w**0.5, w
    front = -54.9
    wall = height_table([24, 30, 36], [3.6, 2.4, 1.7], 2.0)
    face = (sphenoid_face() - wall) * Affine(0.9)
    level = depth_table([54, 66, 74, 82], [44.6, 44.6, 42.4, 39.0], 2.0)
    roof = 34.5 + (level - 34.5) * high
    floor = 34.5 + (depth_table([54, 66, 80], [24.6, 23.8, 25.4], 2.0) - 34.5) * high
    body = smooth_max(7.5, floor - z, z - roof)
    lateral = smooth_max(7.5, u - wide, (front - depth) - y)
    body = smooth_max(7.0, body, lateral)
    body = smooth_max(3.0, body, y * 0.9 - face)
    sign = 1.0 if side == Side.RIGHT else -1.0
    shift = sign * intersphenoid_shift(parameters)
    septum = depth_table([56, 66, 78], [0.85, 0.85 + 0.6 * shift, 0.85 + shift], 3.0)
    body = smooth_max(1.2, body, septum - u)
    for name, tube in (
        ("dehiscent-optic", optic_nerve()),
        ("dehiscent-carotid", internal_carotid()),
    ):
        bone = 0.0 if parameters.has(name, side) else CANAL_WALL_MM
        body = smooth_max(0.8, body, bone + parameters.mucosa_mm - tube)
    if parameters.has("onodi", side):
        body = smooth_max(0.8, body, 2 * parameters.mucosa_mm + 0.3 - onodi_cell())
    return body


def onodi_cell() -> Field:
    """Build the posterior cell that grows above the sphenoid to the optic nerve."""
    return Ellipsoid((10.2, -56.0, 42.0), (4.4, 6.6, 4.0))


def onodi(parameters: PhantomParameters, side: Side) -> Field:
    """Build the Onodi cell, indented by the optic nerve."""
    bone = 0.0 if parameters.has("dehiscent-optic", side) else CANAL_WALL_MM
    wall = bone + parameters.mucosa_mm
    return smooth_max(0.8, onodi_cell(), wall - optic_nerve())


def onodi_outlet() -> Field:
    """Build the Onodi cell's way to the posterior ethmoid's root cell."""
    return Chain(((10.0, -51.5, 42.2), (9.0, -41.0, 33.5)), (1.2, 1.2))


def sphenoid_ostium() -> Field:
    """Build the sphenoid ostium in the sphenoethmoidal recess."""
    return Chain(
        ((3.1, -47.0, 29.5), (3.4, -51.0, 33.8), (5.2, -58, 34.5)), (1.6, 1.65, 1.55)
    )


def sphenoid_face() -> Field:
    """Return the depth y of the wall between nose and sphenoid over the height."""
    return height_table(
        [16, 20, 22.5, 25, 44, 80], [-60, -59, -56.6, -53.6, -52, -47], 1.0
    )
