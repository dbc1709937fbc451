"""How a volume is shown: points from density to colour and opacity, and a threshold.

What a person edits is in sRGB and in opacity per millimetre; a renderer is given the
linear transfer function that it means.
"""

import re
from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np

from renderers.fsr.fuzzy_set import BOUNDARY_THRESHOLD
from renderers.scene import PhongMaterial, TransferFunction
from renderers.scene.transfer import MAX_OPACITY
from system import UserError, whole_file
from system.typed_record import decode_json

REFERENCE_MM = 1.0
"""Opacities are those of so much tissue."""

WHAT = "a look of a volume"


class LookPoint(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Give one density its colour, ``#rrggbb`` in sRGB, and opacity a millimetre."""

    density: float
    colour: str
    opacity: float


class VolumeLook(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a volume is shown; a JSON file holds one.

    points: by increasing density; straight lines lie between them, and the last colours
    hold beyond. threshold: opacity of a voxel's boundary from which on it is splatted.
    ambient, diffuse, specular: light that falls from everywhere, on what faces a light,
    and in glints. surface: density at which the surface view lies.
    """

    name: str
    points: tuple[LookPoint, ...]
    surface: float
    threshold: float = BOUNDARY_THRESHOLD
    ambient: float = 0.25
    diffuse: float = 0.9
    specular: float = 0.1

    def transfer(self) -> TransferFunction:
        """Return the transfer function; UserError names the point that is wrong."""
        check(self)
        return TransferFunction.from_opacity(
            np.array([point.density for point in self.points]),
            np.array([linear_of(point.colour) for point in self.points]),
            np.array([min(point.opacity, MAX_OPACITY) for point in self.points]),
            REFERENCE_MM,
        )

    def material(self) -> PhongMaterial:
        """Return how the volume answers light."""
        return PhongMaterial(self.ambient, self.diffuse, self.specular)


def _demand(name: str, value: float, most: float = 1.0) -> None:
    if not 0.0 <= value <= most:
        raise UserError(f"{name} must lie between 0 and {most:g}, got {value:g}")


def check(look: VolumeLook) -> None:
    """Refuse a look that cannot be drawn, with the point that is wrong."""
    if len(look.points) < 2:
        raise UserError(f"a look needs at least two points, got {len(look.points)}")
    for point in look.points:
        _demand(f"the opacity at density {point.density:g}", point.opacity)
        linear_of(point.colour)
        if not np.isfinite(point.density):
            raise UserError(f"a point's density must be a number, got {point.density}")
    for before, after in pairwise(look.points):
        if not before.density < after.density:
            raise UserError(
                "the densities of a look must increase: "
                f"{after.density:g} follows {before.density:g}"
            )
    if not np.isfinite(look.surface):
        raise UserError(f"surface must be a density, got {look.surface}")
    _demand("threshold", look.threshold)
    for name in ("ambient", "diffuse", "specular"):
        _demand(name, getattr(look, name), 2.0)


def linear_of(colour: str) -> tuple[float, float, float]:
    """Return linear RGB of ``#rrggbb`` (IEC 61966-2-1)."""
    if re.fullmatch(r"#[0-9a-fA-F]{6}", colour) is None:
        raise UserError(f"a colour is written #rrggbb, got {colour!r}")
    codes = np.array([int(colour[n : n + 2], 16) for n in (1, 3, 5)]) / 255.0
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    red, green, blue = linear.tolist()
    return red, green, blue


def load_look(file: Path) -> VolumeLook:
    """Read a look; errors name file, line and the nearest known word."""
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UserError(f"{file} cannot be read: {error.strerror}.") from error
    look = decode_json(content, VolumeLook, file, WHAT)
    try:
        check(look)
    except UserError as error:
        raise UserError(f"{file} is not valid as {WHAT}: {error}.") from error
    return look


def save_look(look: VolumeLook, file: Path) -> None:
    """Write a look, whole or not at all."""
    check(look)
    with whole_file(file) as partial:
        partial.write_bytes(msgspec.json.format(msgspec.json.encode(look), indent=2))
