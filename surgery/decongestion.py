"""Decongestion: the turbinates' mucosa shrinks and pales before an operation begins."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.redistance import redistance
from anatomy.tissue import Label
from renderers.scene import AirSurface, Volume
from system import UserError

BLOOD_BIAS = 0.4
"""Factor on the blood content of decongested mucosa, and on how it bleeds."""

SHRINKS_MM = 1.0
"""So much the mucosa of a turbinate shrinks at most."""

_SMOOTH_MM = 1.2
"""Over this the shrinkage fades where a turbinate joins the wall."""

_LEFT_ON_BONE_MM = 0.3
_CORE_SLOPE = 0.75
"""Where the distance grows more slowly than this, surfaces on both sides are as near:
the middle of a plate, which stays whole."""

_LEAST_MM = 0.02
"""A distance that changes by less is left as it is."""

_SHRINKING = (Label.INFERIOR_TURBINATE, Label.MIDDLE_TURBINATE)


def decongest(
    surface: AirSurface, labels: Volume, shrinks_mm: float = SHRINKS_MM
) -> AirSurface:
    """Return the surface pale, and with the lower two turbinates shrunk.

    The new field is ``min(d, max(d - s, kept))`` made a distance again: s fades from
    `shrinks_mm` on a turbinate to 0 on other walls, and kept is above 0 in turbinate
    bone, 0.3 mm around it and in the middle of thin parts. So the airway only widens,
    and no plate is broken through. All blood content is `BLOOD_BIAS` times what it was.
    labels: of the head, on the surface's grid. The
    surface has no wounds yet: do this before a patient is operated on.
    """
    volume = surface.distance
    d = volume.values
    if labels.shape != volume.shape:
        raise UserError(
            f"labels of shape {labels.shape} do not fit a head of {volume.shape}"
        )
    if surface.wounds is not None:
        raise UserError("a head is decongested before it is operated on")
    if not 0 <= shrinks_mm <= 3:
        raise UserError(f"mucosa shrinks by 0 to 3 mm, got {shrinks_mm}")
    spacing = volume.spacing_mm
    if float(np.ptp(spacing)) > 1e-6:
        raise UserError(f"decongestion needs cubic voxels, got {spacing} mm")
    h = float(spacing[0])
    swollen = np.isin(labels.values, _SHRINKING)
    if shrinks_mm == 0 or not swollen.any():
        return surface
    here = _box(swollen, round(6.0 / h))
    field = d[here].copy()
    shrunk = np.minimum(
        field,
        np.maximum(
            field - shrinks_mm * _weight(swollen[here], field > 0, h),
            _kept(field, labels.values[here], h),
        ),
    )
    _drop_loose(shrunk, h)
    whole = d.copy()
    whole[here] = shrunk
    again = redistance(whole, h)
    whole = np.where(again < d - _LEAST_MM, again, d)
    distance = volume.with_values(whole, volume.background)
    # blood fractions are stored as square roots
    pale = np.rint(surface.blood.values * math.sqrt(BLOOD_BIAS)).astype(np.uint8)
    blood = surface.blood.with_values(pale, surface.blood.background)
    return AirSurface(distance, blood, surface.skin)


def _box(mask: NDArray[np.bool_], margin: int) -> tuple[slice, ...]:
    """Return the part of a volume that holds what is marked, and a margin."""
    found = ndimage.find_objects(mask.astype(np.int8))[0]
    return tuple(
        slice(max(s.start - margin, 0), min(s.stop + margin, n))
        for s, n in zip(found, mask.shape, strict=True)
    )


def _drop_loose(field: NDArray[np.float32], h: float) -> None:
    """Make air of what hangs on nothing in a box: tips shrink away.

    What reaches a face of the box may hang on what lies beyond.
    """
    numbers, count = ndimage.label(field > 0, np.ones((3, 3, 3)))
    if count > 1:
        faces = np.ones_like(field, dtype=bool)
        faces[1:-1, 1:-1, 1:-1] = False
        loose = np.ones(count + 1, bool)
        loose[numbers[faces]] = False
        loose[[0, int(np.bincount(numbers[numbers > 0]).argmax())]] = False
        field[loose[numbers]] = -0.1 * h


def _weight(
    swollen: NDArray[np.bool_], tissue: NDArray[np.bool_], h: float
) -> NDArray[np.float32]:
    """Return 1 on turbinates, 0 on what is nearer to another wall, smooth on tissue."""
    sigma = _SMOOTH_MM / h
    own = ndimage.gaussian_filter(swollen.astype(np.float32), sigma, truncate=3.0)
    every = ndimage.gaussian_filter(
        (tissue | swollen).astype(np.float32), sigma, truncate=3.0
    )
    share = own / np.maximum(every, 1e-6)
    nearest = ndimage.distance_transform_edt(
        ~(tissue | swollen), return_distances=False, return_indices=True
    )
    owned = swollen[tuple(nearest)]
    weight = np.clip(2.0 * share - 1.0, 0.0, 1.0)
    result: NDArray[np.float32] = np.where(owned, weight, 0.0).astype(np.float32)
    return result


def _kept(
    field: NDArray[np.float32], labels: NDArray[np.uint8], h: float
) -> NDArray[np.float32]:
    """Return a field above 0 in what must not shrink."""
    bone = labels == Label.TURBINATE_BONE
    kept = np.full(field.shape, -np.inf, np.float32)
    if bone.any():
        away = ndimage.distance_transform_edt(~bone) * h - 0.5 * h
        kept = (_LEFT_ON_BONE_MM - away).astype(np.float32)
    steep = np.sqrt(sum(g * g for g in np.gradient(field, h)))
    core = (field > 0) & (steep < _CORE_SLOPE)
    return np.where(core, np.maximum(kept, np.float32(0.1 * h)), kept)
