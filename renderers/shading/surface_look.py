"""What shading precomputes from one air surface.

Everything here depends on the anatomy and a seed only, never on the view.
"""

import numpy as np
from numpy.typing import NDArray

from renderers.scene.gbuffer import read_only
from renderers.shading.kernels.tissue_surface import SurfaceTables
from renderers.shading.materials import material_table
from renderers.shading.noise import noise_tile, stored_tile, tile_from_mm
from renderers.shading.tissue_colour import SKIN_COLOR, colour_table

LOOK_VERSION = 6
"""Counts what one sees: raised whenever the same view gets other pixels, so that
recorded pictures are not compared with those of another look. 2: shadows of tools,
mirrored walls, hairs, sharp rims. 3: tools' normals rounded otherwise. 4: near hairs
out of focus, near walls that keep their shading, ground steel. 5: mirrored walls and
their shadows to .02 mm. 6: near tools out of focus, none from within; the lens is
soiled in places, with mucus and drops."""

_MOTTLE_VOXELS = 5.7
"""Tile voxels per dominant wavelength of a tile of shortest wavelength 4."""
_VESSEL_VOXELS = 11.4
"""The same for shortest wavelength 8: zero curves need the finer sampling."""


def tint_of(blood: NDArray[np.uint8], skin: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Join codes of blood and of skin as `SurfaceTables` has them."""
    tint = skin.astype(np.uint16)
    tint <<= 8
    tint |= blood
    return tint


def surface_tables(
    tint: NDArray[np.uint16], seed: int, blood_bias: float, full_detail: bool
) -> SurfaceTables:
    """Precompute for a surface; `seed` decides mottle, ripples and vessels.

    tint: see `tint_of`; its owner may change it. blood_bias: factor on all blood
    content.
    """
    to_tile = np.stack(
        [
            tile_from_mm(6.5, _MOTTLE_VOXELS, 0),
            tile_from_mm(1.6, _MOTTLE_VOXELS, 1),
            tile_from_mm(0.55, _MOTTLE_VOXELS, 2),
            tile_from_mm(8.0, _VESSEL_VOXELS, 1),
            tile_from_mm(2.8, _VESSEL_VOXELS, 2),
        ]
    )
    return SurfaceTables(
        read_only(tint.reshape(-1)),
        read_only(rows_of_eight(colour_table())),
        read_only(np.array(SKIN_COLOR, np.float32)),
        material_table(),
        stored_tile(noise_tile(4.0, seed)),
        stored_tile(noise_tile(8.0, seed + 1)),
        read_only(to_tile),
        read_only(np.array([[31, -17, 11], [-7, 41, 23]], np.float32)),
        np.float32(blood_bias),
        full_detail,
    )


def rows_of_eight(table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Pad rows to two loads of four floats; the sixth is the next row's fifth."""
    padded = np.zeros((len(table), 8), np.float32)
    padded[:, :5] = table
    padded[:-1, 5] = table[1:, 4]
    return padded.reshape(-1)
