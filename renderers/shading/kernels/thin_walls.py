"""Compiled: the light that a wall of mucosa, bone and mucosa sends through and back."""

import math

import numpy as np
from numba import njit

from renderers.shading.kernels.field_reads import Place
from renderers.simd.arrays import f32

PARALLEL, SLANTED = f32(0.866), f32(0.5)
"""Cosines of angles between a wall's two faces: up to 30 degrees it is a wall as told
in `wall`, from 60 degrees on an edge. That is as thin, but only there: its light goes
astray into what is thicker, and there is no bone in it."""
MUCOSA_SHARE = f32(0.4)
THICKEST_MUCOSA_MM = f32(0.5)
"""Of a wall's thickness is mucosa on either side, at most so thick; bone is between."""
CELL_SHARE = f32(0.25)
"""Of the inside of the cell behind a thin wall, that is this wall: a cube has a sixth,
half a ball a third."""


@njit(cache=True, nogil=True, error_model="numpy")
def slab(rho: np.float32, thickness: np.float32, length: np.float32) -> Place:
    """Return a slab's transmittance, and what it reflects less than an endless one.

    rho: what the endless one reflects; length: mm in which diffuse light falls to 1/e.
    The law of Kubelka and Munk (Z. techn. Phys. 12, 1931). The third number is e.
    """
    e = f32(math.exp(-thickness / max(length, f32(0.02))))
    rest = (f32(1) - rho * rho) / (f32(1) - rho * rho * e * e)
    return rest * e, rho * rest * e * e, e


@njit(cache=True, nogil=True, error_model="numpy")
def wall(
    thickness: np.float32, rho: np.float32, length: np.float32,
    bone_rho: np.float32, bone_length: np.float32,
) -> tuple[np.float32, np.float32]:  # fmt: skip
    """Return what a wall of mucosa, bone and mucosa sends through, and sends back.

    Layers add as Stokes' plates do (Proc. R. Soc. 11, 1862).
    """
    skin = min(MUCOSA_SHARE * thickness, THICKEST_MUCOSA_MM)
    t, lost, _ = slab(rho, skin, length)
    r = rho - lost
    t_bone, lost, _ = slab(bone_rho, thickness - f32(2) * skin, bone_length)
    r_bone = bone_rho - lost
    # mucosa upon bone, seen from the mucosa and from the bone
    k = f32(1) / (f32(1) - r * r_bone)
    r_front = r + t * t * r_bone * k
    r_back = r_bone + t_bone * t_bone * r * k
    t_two = t * t_bone * k
    k = f32(1) / (f32(1) - r_back * r)
    return t_two * t * k, r_front + t_two * t_two * r * k


@njit(cache=True, nogil=True, error_model="numpy")
def with_cell(through: np.float32, back: np.float32, rho: np.float32) -> np.float32:
    """Return what a thin wall and the cell behind it send back of light before them.

    What gets through goes round in the cell, whose other walls are endless mucosa, as
    in an integrating sphere: each time `CELL_SHARE` of it meets the thin wall. Without
    it a bare wall would be green: thin mucosa scatters no more red than green, and what
    it lets through is red.
    """
    meets = CELL_SHARE
    again = (f32(1) - meets) * rho + meets * back
    return back + through * through * meets / (f32(1) - again)


@njit(cache=True, nogil=True, error_model="numpy")
def likeness_to_wall(normal: Place, behind: Place) -> np.float32:
    """Return how much of a wall is between two faces, by their normals: 0 to 1."""
    along = -(normal[0] * behind[0] + normal[1] * behind[1] + normal[2] * behind[2])
    share = (along - SLANTED) / (PARALLEL - SLANTED)
    return f32(min(max(share, f32(0)), f32(1)))
