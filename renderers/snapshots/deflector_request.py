"""How a request says that tissue is pulled, turned, swollen or cut."""

import math
from typing import Annotated, TypeAlias

import numpy as np
from msgspec import Meta, Struct

from renderers.scene.deflection import (
    Cut,
    Deflection,
    Deflector,
    Rotation,
    Scaling,
    Translation,
)

Coordinate: TypeAlias = Annotated[float, Meta(ge=-1e7, le=1e7)]
Vector: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Millimetres: TypeAlias = Annotated[float, Meta(gt=0, le=1e4)]


class _Ball(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind"):
    center_mm: Vector
    radius_mm: Millimetres


class TranslationSpec(_Ball, frozen=True, tag="translate"):
    """Pull tissue; see `renderers.scene.deflection.Translation`."""

    shift_mm: Vector


class RotationSpec(_Ball, frozen=True, tag="rotate"):
    """Turn tissue; see `renderers.scene.deflection.Rotation`."""

    axis: Vector
    angle_deg: Annotated[float, Meta(ge=-720, le=720)]


class ScalingSpec(_Ball, frozen=True, tag="scale"):
    """Swell or shrink tissue; see `renderers.scene.deflection.Scaling`."""

    factor: Annotated[float, Meta(gt=0, le=1000)]


class CutSpec(_Ball, frozen=True, tag="cut"):
    """Part tissue; see `renderers.scene.deflection.Cut`."""

    normal: Vector
    pull_mm: Millimetres


DeflectorSpec: TypeAlias = TranslationSpec | RotationSpec | ScalingSpec | CutSpec


def to_deflection(specs: tuple[DeflectorSpec, ...]) -> Deflection:
    """Build deflectors; FoldError or ValueError where one cannot be."""
    return Deflection(tuple(_built(spec) for spec in specs))


def _built(spec: DeflectorSpec) -> Deflector:
    center, radius = np.array(spec.center_mm), spec.radius_mm
    match spec:
        case TranslationSpec():
            return Translation(center, radius, np.array(spec.shift_mm))
        case RotationSpec():
            angle = math.radians(spec.angle_deg)
            return Rotation(center, radius, np.array(spec.axis), angle)
        case ScalingSpec():
            return Scaling(center, radius, spec.factor)
        case CutSpec():
            return Cut(center, radius, np.array(spec.normal), spec.pull_mm)
