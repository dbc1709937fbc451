"""What shading precomputes from one air surface.

Everything here depends on the anatomy and a seed only, never on the view. After
cutting, rebuild it (a fraction of a second).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Volume
from renderers.shading.kernels.surface_noise import NoiseTile
from renderers.shading.kernels.tissue_surface import SurfaceTables
from renderers.shading.materials import material_table
from renderers.shading.noise import noise_tile, stored_tile, tile_from_mm
from renderers.shading.tissue_colour import SKIN_COLOR, colour_table

LOOK_VERSION = 4
"""Counts what one sees: raised whenever the same view gets other pixels, so that
recorded pictures are not compared with those of another look. 2: shadows of tools,
mirrored walls, hairs, sharp rims. 3: tools' normals rounded otherwise. 4: near hairs
out of focus, near walls that keep their shading, ground steel."""

_MOTTLE_VOXELS = 5.7
"""Tile voxels per dominant wavelength of a tile of shortest wavelength 4."""
_VESSEL_VOXELS = 11.4
"""The same for shortest wavelength 8: zero curves need the finer sampling."""


@dataclass(frozen=True, slots=True)
class Look:
    """Hold the tables, tiles and tint a shader reads.

    distance: the air surface's own distance volume.
    tint: flat uint16 of the volume's size, blood code + 256 * skin code.
    colours: `colour_table` as flat rows of eight floats. skin: ``(3,)`` linear albedo.
    materials: see `material_table`.
    tile, vessel_tile: noise of mottle and ripples, and of vessels.
    to_tile: ``(5, 3, 3)`` millimetres to tile voxels: mottle of 6.5, 1.6 and .55 mm,
    vessels of 8 and 2.8 mm. vessel_offset_mm: ``(2, 3)`` shifts that keep vessels
    from following the mottle.
    """

    distance: Volume
    tint: NDArray[np.uint16]
    colours: NDArray[np.float32]
    skin: NDArray[np.float32]
    materials: NDArray[np.float32]
    tile: NoiseTile
    vessel_tile: NoiseTile
    to_tile: NDArray[np.float32]
    vessel_offset_mm: NDArray[np.float32]

    @classmethod
    def of(cls, surface: AirSurface, seed: int) -> "Look":
        """Precompute for `surface`; `seed` decides mottle, ripples and vessels."""
        to_tile = np.stack(
            [
                tile_from_mm(6.5, _MOTTLE_VOXELS, 0),
                tile_from_mm(1.6, _MOTTLE_VOXELS, 1),
                tile_from_mm(0.55, _MOTTLE_VOXELS, 2),
                tile_from_mm(8.0, _VESSEL_VOXELS, 1),
                tile_from_mm(2.8, _VESSEL_VOXELS, 2),
            ]
        )
        tint = surface.skin.values.astype(np.uint16)
        tint <<= 8
        tint |= surface.blood.values
        look = cls(
            surface.distance,
            tint.reshape(-1),
            rows_of_eight(colour_table()),
            np.array(SKIN_COLOR, np.float32),
            material_table(),
            stored_tile(noise_tile(4.0, seed)),
            stored_tile(noise_tile(8.0, seed + 1)),
            to_tile,
            np.array([[31, -17, 11], [-7, 41, 23]], np.float32),
        )
        for array in (
            look.tint,
            look.colours,
            look.skin,
            look.to_tile,
            look.vessel_offset_mm,
        ):
            array.flags.writeable = False
        return look

    def tables(self, blood_bias: float, full_detail: bool) -> SurfaceTables:
        """Return what the kernels take; blood_bias: factor on all blood content."""
        return SurfaceTables(
            self.tint,
            self.colours,
            self.skin,
            self.materials,
            self.tile,
            self.vessel_tile,
            self.to_tile,
            self.vessel_offset_mm,
            np.float32(blood_bias),
            full_detail,
        )


def rows_of_eight(table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Pad rows to two loads of four floats; the sixth is the next row's fifth."""
    padded = np.zeros((len(table), 8), np.float32)
    padded[:, :5] = table
    padded[:-1, 5] = table[1:, 4]
    return padded.reshape(-1)
