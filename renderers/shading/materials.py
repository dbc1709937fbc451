"""How each G-buffer material answers light, as one table for the kernel."""

from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Material
from renderers.shading.tissue_colour import (
    BONE,
    BONE_EDGE,
    CUT_BONE,
    DEEP_TISSUE,
    FRESH_BLOOD,
    POLYP,
    RAW_FLESH,
    TissueOptics,
)

WATER_F0 = 0.021
"""Normal reflectance of the watery film on mucosa (n = 1.34)."""
FILM_ALPHA = 0.045
"""GGX width of that film at rest: two fibre crescents stay two glints at 10 mm."""


@dataclass(frozen=True, slots=True)
class SurfaceOptics:
    """Describe one material.

    tissue: share of the colour and scattering that comes from the blood volume.
    red, green, blue: linear albedo added to that share.
    f0, alpha: Fresnel reflectance at normal incidence, GGX width.
    relief: factor on bump slopes (0 for machined things).
    red_mm, green_mm: diffusion lengths added to the tissue's share.
    """

    tissue: float
    red: float
    green: float
    blue: float
    f0: float
    alpha: float
    relief: float
    red_mm: float
    green_mm: float


def _of_optics(optics: TissueOptics, relief: float, alpha: float) -> SurfaceOptics:
    red, green, blue = (float(c) for c in optics.color())
    return SurfaceOptics(
        0.0, red, green, blue, WATER_F0, alpha, relief, *optics.diffusion_lengths_mm()
    )


SURFACES: dict[Material, SurfaceOptics] = {
    Material.TISSUE: SurfaceOptics(1, 0, 0, 0, WATER_F0, FILM_ALPHA, 1, 0, 0),
    Material.METAL: SurfaceOptics(0, 0.04, 0.04, 0.04, 0.55, 0.25, 0, 0, 0),
    Material.DARK_PLASTIC: SurfaceOptics(0, 0.02, 0.02, 0.022, 0.04, 0.25, 0, 0, 0),
    # a pool is flat, and as wet as it gets
    Material.BLOOD: _of_optics(FRESH_BLOOD, 0.3, FILM_ALPHA),
    # clear mucus: a thick smooth film over the tissue with a little white scatter
    Material.MUCUS: SurfaceOptics(
        0.92, 0.05, 0.05, 0.05, WATER_F0, FILM_ALPHA / 2, 0.5, 0, 0
    ),
    Material.POLYP: _of_optics(POLYP, 0.6, FILM_ALPHA),
    Material.BONE: _of_optics(BONE, 1.0, 0.25),
    # torn, so that the film is no mirror even where no relief is resolved
    Material.RAW_FLESH: _of_optics(RAW_FLESH, 1.0, 0.13),
    Material.BONE_EDGE: _of_optics(BONE_EDGE, 1.0, 0.18),
    Material.CUT_BONE: _of_optics(CUT_BONE, 1.0, 0.34),
    Material.DEEP_TISSUE: _of_optics(DEEP_TISSUE, 1.0, 0.15),
}

F0 = 4
"""Column of the kernel's table, whose columns are SurfaceOptics's fields."""


def material_table() -> NDArray[np.float32]:
    """Return ``(materials, 9)`` float32 rows in the order of `Material`."""
    table = np.array([astuple(SURFACES[m]) for m in Material], dtype=np.float32)
    table.flags.writeable = False
    return table
