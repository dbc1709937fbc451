"""Named places of the head, in world millimetres."""

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from anatomy.frame import lps_from_ras
from anatomy.phantom.ethmoid import RETROBULBAR, lamina_papyracea, suprabullar
from anatomy.phantom.fixed_shapes import middle_of
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.sinuses import accessory_place
from anatomy.phantom.sphenoid import pneumatization, sphenoid_middle
from anatomy.phantom.spread import spread_waves, unmoved
from anatomy.table_file import read_table
from anatomy.tissue import Side


@dataclass(frozen=True, slots=True)
class Landmark:
    """Name a place. position_mm: ``(3,)`` LPS; radius_mm: how far it extends."""

    name: str
    side: Side
    position_mm: NDArray[np.float64]
    radius_mm: float

    @property
    def key(self) -> str:
        """Return the name with its side, such as ``middle turbinate head, left``."""
        if self.side == Side.MIDLINE:
            return self.name
        return f"{self.name}, {self.side.name.lower()}"


_ARTERIES = ("anterior ethmoidal artery", "posterior ethmoidal artery")


class _Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hold ``landmarks.toml``."""

    paired: dict[str, tuple[float, ...]]
    midline: dict[str, tuple[float, float, float, float]]
    variants: dict[str, str]


_TABLE = read_table(__file__, "landmarks.toml", _Table)

VARIANT_PLACES = _TABLE.variants
"""Landmarks that only a side with the variant has."""


def landmarks(parameters: PhantomParameters) -> dict[str, Landmark]:
    """List the landmarks of one head by `Landmark.key`, both sides.

    The septum's deviation shifts them as it shifts the anatomy around them. What a
    side lacks has no landmark: see `lacking`.
    """

    built = {
        "retrobulbar recess": RETROBULBAR,
        "suprabullar cell": suprabullar(parameters),
        "supraorbital cell": middle_of("supraorbital"),
        "frontal septal cell": middle_of("septal cell"),
    }

    def sized(name: str, side: Side) -> tuple[float, ...]:
        """Return u, y, z and radius; the sinuses' middles move with their sizes."""
        values = _TABLE.paired[name]
        if name in ("ethmoid roof", *_ARTERIES):
            drop = 3.0 if parameters.has("hanging-artery", side) else 0.0
            sunk = drop if name == "anterior ethmoidal artery" else 0.0
            a, b, c, radius = values
            return a, b, c + parameters.roof_mm - sunk, radius
        if name == "olfactory fossa":
            a, b, c, radius = values
            return a, b, c + 0.88 * parameters.roof_mm - parameters.keros(side), radius
        if name == "frontal sinus":
            q = max(parameters.scale("frontal", side), 0.5)
            return 2.6 + 7.2 * q, -5.2, 56.0 + 9.0 * q**0.6, 6.0 * q**0.5
        if name == "sphenoid sinus":
            place, radius = sphenoid_middle(parameters, side)
            return *place, radius
        if name == "maxillary sinus":
            k = parameters.scale("maxillary", side)
            return 14.6 + 11.4 * k, -28.0, 25.0 - 13.0 * k, 10.0 * k
        if name == "lamina dehiscence":
            a, b, c = middle_of("lamina gap")
            wall = lamina_papyracea(parameters, side).evaluate(
                np.array([[a], [b], [c]])
            )
            return float(wall[0]), b, c, *values
        if name == "accessory maxillary ostium":
            return *accessory_place(parameters, side), *values
        return *built.get(name, ()), *values

    found = [
        _place(name, Side.MIDLINE, values, parameters)
        for name, values in _TABLE.midline.items()
    ]
    for side in (Side.RIGHT, Side.LEFT):
        absent = lacking(parameters, side)
        found += [
            _place(name, side, sized(name, side), parameters)
            for name in _TABLE.paired
            if name not in absent
        ]
    return {landmark.key: landmark for landmark in found}


def lacking(parameters: PhantomParameters, side: Side) -> frozenset[str]:
    """Name the paired landmarks that one side of a head does not have.

    Some cells, recesses and gaps are variants (`VARIANT_PLACES`), as is a second
    maxillary ostium; an aplastic frontal sinus has neither ostium nor septal cell;
    surgery takes the uncinate process and, with it, the hiatus behind its edge. A
    carotid presses into sinuses that reach the sella only.
    """
    absent: set[str] = set()
    for variant, name in VARIANT_PLACES.items():
        if not parameters.has(variant, side):
            absent.add(name)
    if not parameters.has("dehiscent-lamina", side):
        absent.add("lamina dehiscence")
    if pneumatization(parameters, side) in ("conchal", "presellar"):
        absent |= {"carotid bulge", "opticocarotid recess"}
    if parameters.scale("frontal", side) == 0:
        absent |= {"frontal sinus", "frontal ostium", "frontal septal cell"}
    if parameters.is_operated(side):
        absent |= {"uncinate process", "hiatus semilunaris"}
    return frozenset(absent)


def _place(
    name: str,
    side: Side,
    values: tuple[float, ...],
    parameters: PhantomParameters,
) -> Landmark:
    at = np.array(values[:3], dtype=np.float64)
    place = septal_shift(parameters, at, side)
    return Landmark(name, side, place, parameters.head_scale * float(values[3]))


def septal_shift(
    parameters: PhantomParameters, points: NDArray[np.float64], side: Side
) -> NDArray[np.float64]:
    """Turn ``(..., 3)`` points (u, y, z) of one side into LPS places in mm.

    The septum's deviation moves all that is near it; midline points stay.
    """
    placed = np.array(points, dtype=np.float64)
    y, z = placed[..., 1], placed[..., 2]
    deviation = 0.0 if side == Side.MIDLINE else parameters.septal_deviation_mm
    shift = deviation * np.exp(-(((y + 22) / 14) ** 2) - ((z - 16) / 12) ** 2)
    placed[..., 0] = placed[..., 0] * (-1.0 if side == Side.LEFT else 1.0) + shift
    flat = unmoved(placed.reshape(-1, 3), spread_waves(parameters))
    return lps_from_ras(parameters.head_scale * flat.reshape(placed.shape))
