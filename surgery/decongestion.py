"""Decongestion: the turbinates' mucosa shrinks and pales before an operation begins."""

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
import xxhash
from numpy.typing import NDArray
from scipy import ndimage

import anatomy.redistance
from anatomy.kernels import sweep_distance
from anatomy.tissue import Label
from renderers.scene import AirSurface, Volume
from renderers.scene.cache_entries import kept_entry, read_arrays
from surgery.kernels import peel_tissue
from surgery.kernels.peel_tissue import peel
from system import UserError

Distance = NDArray[np.float32]

log = logging.getLogger(__name__)

BLOOD_BIAS = 0.4
"""Factor on the blood content of decongested mucosa, and on how it bleeds."""

SHRINKS_MM = 1.0
"""So much the mucosa of a turbinate shrinks at most."""

_SMOOTH_MM = 1.2
"""Over this the shrinkage fades where a turbinate joins the wall."""

_LEFT_MM = 0.3
"""Of mucosa on bone, and on the middle of what has none: with the voxel that this is, a
plate of 1.1 mm, which the grid shows whole."""

_LEFT_VOXELS = 0.25
"""Of an edge, of a voxel that has to stay lest something come loose."""

_CORE_SLOPE = 0.75
"""Where the distance grows more slowly than this, surfaces on both sides are as near:
the middle of a plate, which stays whole."""

_LEAST_MM = 0.02
"""A distance that changes by less is left as it is."""

ENTRIES_KEPT = 8
"""Of shrunk heads; the least used beyond are removed: one at 0.5 mm takes 40 MB."""

_SHRINKING = (Label.INFERIOR_TURBINATE, Label.MIDDLE_TURBINATE)


def decongest(
    surface: AirSurface,
    labels: Volume,
    shrinks_mm: float = SHRINKS_MM,
    folder: Path | None = None,
) -> AirSurface:
    """Return the surface pale, and with the lower two turbinates shrunk.

    It takes a second or two, and is read from `folder` where it was kept there.

    The new field is ``min(d, max(d - s, kept))`` made a distance again: s fades from
    `shrinks_mm` on a turbinate to 0 on other walls, and kept is above 0 in turbinate
    bone, 0.3 mm around it and in the middle of thin parts. So the airway only widens,
    and no plate is broken through. All blood content is `BLOOD_BIAS` times what it was.
    labels: of the head, on the surface's grid. The surface has no wounds yet: do this
    before a patient is operated on.
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
    if shrinks_mm == 0 or not np.isin(labels.values, _SHRINKING).any():
        return surface
    entry = None if folder is None else folder / _name(d, labels.values, shrinks_mm)
    whole = None

    def read(archive: Any) -> Distance:
        field: Distance = archive["distance"]
        if field.dtype != np.float32 or field.shape != d.shape:
            raise UserError(f"the distance is {field.dtype} {field.shape}")
        return field

    if entry is not None:
        whole = read_arrays(entry, "a shrunk head", read)
    if whole is None:
        whole = _shrunk(d, labels.values, shrinks_mm, float(spacing[0]))
        if entry is not None:
            _keep(entry, whole)
    distance = volume.with_values(whole, volume.background)
    # blood fractions are stored as square roots
    pale = np.rint(surface.blood.values * math.sqrt(BLOOD_BIAS)).astype(np.uint8)
    blood = surface.blood.with_values(pale, surface.blood.background)
    return AirSurface(distance, blood, surface.skin)


def _shrunk(
    d: Distance, labels: NDArray[np.uint8], shrinks_mm: float, h: float
) -> Distance:
    """Return the distance, mm, that is left of `d`; voxels have edges of h mm."""
    swollen = np.isin(labels, _SHRINKING)
    here = _box(swollen, round(6.0 / h))
    field = d[here]
    shrunk = np.minimum(
        field,
        np.maximum(
            field - shrinks_mm * _weight(swollen[here], field > 0, h),
            _kept(field, labels[here], h),
        ),
    )
    _mend(field, shrunk, h)
    whole = d.copy()
    whole[here] = shrunk
    again = anatomy.redistance.redistance(whole, h)
    return np.where(again < d - _LEAST_MM, again, d)


def _name(d: Distance, labels: NDArray[np.uint8], shrinks_mm: float) -> str:
    """Return the name of a file for the field of a head, by the present code."""
    digest = xxhash.xxh3_128(f"{d.shape} {shrinks_mm}".encode())
    sources = (anatomy.redistance, sweep_distance, peel_tissue)
    for source in (__file__, *(str(module.__file__) for module in sources)):
        digest.update(Path(source).read_bytes())
    digest.update(d.tobytes())
    digest.update(labels.tobytes())
    return f"{digest.hexdigest()}.npz"


def _keep(entry: Path, field: Distance) -> None:
    try:
        with kept_entry(entry, ENTRIES_KEPT) as beside:
            np.savez(beside, distance=field)
    except OSError as error:
        log.warning("a shrunk head could not be kept as %s: %s", entry, error)


def _box(mask: NDArray[np.bool_], margin: int) -> tuple[slice, ...]:
    """Return the part of a volume that holds what is marked, and a margin."""
    found = ndimage.find_objects(mask.astype(np.int8))[0]
    return tuple(
        slice(max(s.start - margin, 0), min(s.stop + margin, n))
        for s, n in zip(found, mask.shape, strict=True)
    )


def _mend(before: Distance, after: Distance, h: float) -> None:
    """Leave tissue in place without which a piece or a hole would be more, or less."""
    tissue = before > 0
    places = np.argwhere(tissue & (after <= 0))
    order = np.argsort(before[tuple(places.T)], kind="stable")
    peel(tissue, places[order])
    left = tissue & (after <= 0)
    after[left] = np.minimum(before[left], np.float32(_LEFT_VOXELS * h))


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
    steep = np.sqrt(sum(g * g for g in np.gradient(field, h)))
    core = (field > 0) & (steep < _CORE_SLOPE)
    solid = core | (labels == Label.TURBINATE_BONE)
    away = ndimage.distance_transform_edt(~solid) * h - 0.5 * h
    kept: NDArray[np.float32] = (_LEFT_MM - away).astype(np.float32)
    return kept
