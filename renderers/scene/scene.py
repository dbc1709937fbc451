"""What is to be seen: a volume, how it is classified, its lights, its air surface."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from renderers.scene.camera import Camera
from renderers.scene.gbuffer import GBuffer
from renderers.scene.image import Image
from renderers.scene.light import Light, four_lights
from renderers.scene.transfer import TransferFunction
from renderers.scene.volume import Volume
from system import UserError

WOUND_UNIT_MM = 0.02
"""Depths and thicknesses of layers are stored in these steps, up to 5.1 mm."""

FILM_UNIT_MM = 0.01
"""Thickness of blood on a surface is stored in these steps, up to 2.55 mm."""


@dataclass(frozen=True, slots=True)
class Wounds:
    """What tells a cut surface from a healthy one; all on the distance's grid.

    The surface is a cut where the pristine distance at it is above about 0.1 mm: so
    deep it lies below the mucosa that was. That depth picks the layer laid open.

    pristine: float32 mm, the signed air distance before any tissue was taken.
    flesh: uint8, depth at which bone begins, in steps of `WOUND_UNIT_MM`; 255 for
        nowhere.
    bone: uint8, thickness of that bone in the same steps.
    deep: uint8, what lies beyond it: 0 soft tissue, 255 bone.
    film: uint8, thickness of blood on the surface, in steps of `FILM_UNIT_MM`.
    pale: uint8, how far an injection has driven the blood out of mucosa, 255 for as far
        as it goes; None where nobody injects.
    """

    pristine: Volume
    flesh: Volume
    bone: Volume
    deep: Volume
    film: Volume
    pale: Volume | None = None


@dataclass(frozen=True, slots=True)
class RestOffsets:
    """Where tissue lies at rest that is shown elsewhere, since it was pushed.

    What is shown at a place p lies at ``p + (x, y, z)`` at rest, and has the look that
    it has there.

    pristine: float32 mm, the distance before any tissue was taken, as it is at rest.
    x, y, z: float32 mm along the world's axes, on the distance's grid.
    box: ``(6,)`` float32, low and high voxel coordinates beyond which all are 0; the
        high ones are not above the low ones where nothing is pushed. Whoever edits the
        volumes in place writes this, too.
    """

    pristine: Volume
    x: Volume
    y: Volume
    z: Volume
    box: NDArray[np.float32]

    @property
    def is_any(self) -> bool:
        """Return whether anything may be pushed."""
        return bool(self.box[3] > self.box[0])

    def sample(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the offsets ``(..., 3)`` of shown places, mm."""
        axes = self.x, self.y, self.z
        return np.stack([axis.sample(points_mm) for axis in axes], axis=-1)


@dataclass(frozen=True, slots=True)
class AirSurface:
    """Describe the boundary between air and tissue, which an endoscope sees.

    distance: float32 mm, signed distance to the boundary, *negative in air*. Its
        zero set is the surface in mode `scope`, in both renderers.
    blood: uint8 on the same grid, blood volume fraction ``B = (v / 255)**2``.
    skin: uint8 on the same grid, weight 0..255 of dry skin over mucosa.
    wounds: what shows cuts and blood; None where nobody operates.
    rest: where what is shown lies at rest; None where nobody pushes. The distance, and
        the pristine one of wounds, are as shown; all else is as it lies at rest.
    """

    distance: Volume
    blood: Volume
    skin: Volume
    wounds: Wounds | None = None
    rest: RestOffsets | None = None

    def __post_init__(self) -> None:
        if self.distance.values.dtype != np.float32:
            raise UserError(
                f"air distance must be float32, got {self.distance.values.dtype}"
            )
        for name, volume in (("blood", self.blood), ("skin", self.skin)):
            if volume.values.dtype != np.uint8 or volume.shape != self.distance.shape:
                raise UserError(
                    f"{name} must be uint8 of shape {self.distance.shape}, got "
                    f"{volume.values.dtype} {volume.shape}"
                )


@dataclass(frozen=True, slots=True)
class PhongMaterial:
    """Set how a sample of mode `classic` answers light (Phong, two-sided off).

    Radiance = color * (ambient + diffuse * sum_l max(n.l, 0)) + specular term
    ``specular * sum_l max(n.h, 0)**shininess``; n points towards lower density.
    """

    ambient: float = 0.25
    diffuse: float = 0.9
    specular: float = 0.0
    shininess: float = 16.0


@dataclass(frozen=True, slots=True)
class Scene:
    """Join everything a renderer needs.

    `volume`, `transfer_function`, `lights` and `material` make mode `classic`;
    `surface` makes mode `scope` and may be absent for volumes without air.
    """

    volume: Volume
    transfer_function: TransferFunction
    lights: tuple[Light, ...] = field(default_factory=four_lights)
    material: PhongMaterial = field(default_factory=PhongMaterial)
    surface: AirSurface | None = None

    def diffuse_light(
        self, normals: NDArray[np.floating], places: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Return ambient and diffuse light at places, ``(n, 3)`` linear RGB.

        normals, places: ``(n, 3)`` world, the latter in mm. There are no shadows;
        nothing but ambient light falls on what looks away from a light, or has no
        normal.
        """
        light = np.full(normals.shape, self.material.ambient, np.float64)
        for source in self.lights:
            towards = source.vector
            if source.is_local:
                towards = source.vector - places
                length = np.linalg.norm(towards, axis=1, keepdims=True)
                towards = towards / np.maximum(length, 1e-9)
            facing = np.maximum((normals * towards).sum(axis=1, keepdims=True), 0)
            light += self.material.diffuse * facing * source.color
        return light


class Renderer(Protocol):
    """Promise what both renderers can do."""

    def render(self, camera: Camera) -> Image:
        """Draw mode `classic`: premultiplied linear RGBA."""
        ...

    def gbuffer(self, camera: Camera) -> GBuffer:
        """Find the air surface behind each pixel: the geometry of mode `scope`.

        Raises UserError when the scene has no air surface.
        """
        ...
