"""Deformed tissue on its own grid: what a renderer that knows no deflectors draws."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from renderers.scene.deflection.chain import Deflection
from renderers.scene.deflection.deflector import Points
from renderers.scene.scene import AirSurface, Scene, Wounds
from renderers.scene.volume import Volume

RAW_BLOOD = 72
"""Least code of the blood volume beside a cut: 8 %. What is cut open bleeds; the
tissue's own tint is known at its surface only, and is white deep inside."""

RAW_DEPTH_MM = 2.0


def deflected_volume(volume: Volume, deflection: Deflection) -> Volume:
    """Sample a volume's pull-back at its own grid points; gaps hold the background.

    Grid points that are not moved keep their bits.
    """
    voxels, x = _moved(volume, deflection)
    values = volume.sample(deflection.pull_back(x))
    values[deflection.opening(x) < 0] = volume.background
    return _with(volume, voxels, values)


def deflected_distance(distance: Volume, deflection: Deflection) -> Volume:
    """Sample the pull-back of a distance negative in air; gaps are air.

    Its zero set is the deformed surface. Values are divided by how much a step at x is
    stretched into one at q, so that near the surface none is longer than the distance.
    """
    voxels, x = _moved(distance, deflection)
    stretch = np.linalg.norm(deflection.jacobian(x), ord=2, axis=(1, 2))
    values = distance.sample(deflection.pull_back(x)) / np.maximum(stretch, 1.0)
    return _with(distance, voxels, np.minimum(values, deflection.opening(x)))


def deflected_surface(surface: AirSurface, deflection: Deflection) -> AirSurface:
    """Deform the boundary of the air and what colours it; the faces of cuts are raw."""
    blood = deflected_volume(surface.blood, deflection)
    voxels, x = _moved(blood, deflection)
    raw = voxels[np.abs(deflection.opening(x)) < RAW_DEPTH_MM]
    tint = blood.values[tuple(raw.T)]
    wounds = surface.wounds
    if wounds is not None:
        wounds = Wounds(
            deflected_distance(wounds.pristine, deflection),
            deflected_volume(wounds.flesh, deflection),
            deflected_volume(wounds.bone, deflection),
            deflected_volume(wounds.deep, deflection),
            deflected_volume(wounds.film, deflection),
            wounds.pale and deflected_volume(wounds.pale, deflection),
        )
    return AirSurface(
        deflected_distance(surface.distance, deflection),
        _with(blood, raw, np.maximum(tint, RAW_BLOOD)),
        deflected_volume(surface.skin, deflection),
        wounds,
    )


def deflected_scene(scene: Scene, deflection: Deflection) -> Scene:
    """Deform all that is in a scene but its lights."""
    surface = scene.surface
    if surface is not None:
        surface = deflected_surface(surface, deflection)
    volume = deflected_volume(scene.volume, deflection)
    return replace(scene, volume=volume, surface=surface)


def _moved(volume: Volume, deflection: Deflection) -> tuple[NDArray[np.int64], Points]:
    """Find the grid points that a deflection may move: (k, j, i) and world places."""
    matrix, inverse = volume.world_from_voxel, volume.voxel_from_world
    marked = np.zeros(volume.shape, bool)
    for deflector in deflection.deflectors:
        reach = deflector.radius_mm * np.linalg.norm(inverse[:3, :3], axis=1)
        middle = inverse[:3, :3] @ deflector.center_mm + inverse[:3, 3]
        top = np.array(volume.shape[::-1])
        low = np.clip(np.floor(middle - reach), 0, top).astype(int)[::-1]
        high = np.clip(np.ceil(middle + reach) + 1, 0, top).astype(int)[::-1]
        box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        places = np.argwhere(np.ones(tuple(high - low), bool)) + low
        x = places[:, ::-1] @ matrix[:3, :3].T + matrix[:3, 3]
        marked[box] |= deflector.inside(x).reshape(tuple(high - low))
    voxels = np.argwhere(marked).astype(np.int64)
    return voxels, voxels[:, ::-1] @ matrix[:3, :3].T + matrix[:3, 3]


def _with(volume: Volume, voxels: NDArray[np.int64], values: Points) -> Volume:
    changed = volume.values.copy()
    if np.issubdtype(changed.dtype, np.integer):
        values = np.rint(values)
    changed[tuple(voxels.T)] = values
    return volume.with_values(changed, volume.background)
