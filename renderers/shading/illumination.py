"""The scope's own light, and how finely a tier samples what it does."""

import math
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera

_CRESCENT_HALF_ANGLE = 0.9
"""Radians on either side of the horizontal: what the two fibre crescents cover."""


@dataclass(frozen=True, slots=True)
class ScopeLight:
    """Place the fibre ends around the lens.

    ring_radius_mm: 1.45 for a 4 mm scope, .95 for a 2.7 mm one.
    spread: mu of the spot law ``exp(-mu (1 - cos theta))`` (calibrations of real
        endoscopes give about 2.8).
    power: linear factor on all light.
    """

    ring_radius_mm: float = 1.45
    spread: float = 2.8
    power: float = 1.0

    def __post_init__(self) -> None:
        for name, value, low in (
            ("ring_radius_mm", self.ring_radius_mm, 0.0),
            ("spread", self.spread, 0.0),
            ("power", self.power, 0.0),
        ):
            if not (math.isfinite(value) and value >= low):
                raise ValueError(f"light {name} must be finite and >= 0, got {value}")

    @classmethod
    def for_diameter(cls, diameter_mm: float) -> "ScopeLight":
        """Return the light of a scope of that outer diameter (2.7 and 4 mm exist)."""
        if not 1.0 <= diameter_mm <= 10.0:
            raise ValueError(f"a scope is 1 to 10 mm thick, got {diameter_mm} mm")
        # through (2.7, .95) and (4, 1.45)
        return cls(0.95 + (diameter_mm - 2.7) * (0.5 / 1.3))

    def sources(self, camera: Camera, count: int) -> NDArray[np.float32]:
        """Return ``(count, 3)`` float32 mm from the eye, world axes.

        Half of them on the crescent to the right of the lens, half on the left.
        """
        ring = camera.frame[1:3].T @ _crescents(count).outward
        return np.ascontiguousarray(self.ring_radius_mm * ring.T, np.float32)

    def arcs(self, camera: Camera, count: int) -> NDArray[np.float32]:
        """Return ``(count, 3)`` float32 mm, world axes: how far fibre ends reach.

        A source stands for a stretch of its crescent; an arc leads from it to the end
        of that stretch's chord. What a tool leaves of the light depends on it: with
        points for sources, two of them would cast two hard shadows.
        """
        crescents = _crescents(count)
        along = camera.frame[1:3].T @ crescents.along
        reach = self.ring_radius_mm * math.sin(crescents.step / 2)
        return np.ascontiguousarray(reach * along.T, np.float32)


@dataclass(frozen=True, slots=True)
class _Crescents:
    """Place sources about the view axis.

    outward, along: ``(2, n)`` unit vectors right and up, from the axis and round it.
    step: angle between neighbours.
    """

    outward: NDArray[np.float64]
    along: NDArray[np.float64]
    step: float


@lru_cache(maxsize=8)
def _crescents(count: int) -> _Crescents:
    if count < 2 or count % 2:
        raise ValueError(f"two crescents need an even count >= 2, got {count}")
    half = count // 2
    step = 2 * _CRESCENT_HALF_ANGLE / half
    angle = -_CRESCENT_HALF_ANGLE + (np.arange(half) + 0.5) * step
    angle = np.concatenate([angle, angle + math.pi])
    cosine, sine = np.cos(angle), np.sin(angle)
    return _Crescents(np.stack([cosine, sine]), np.stack([-sine, cosine]), step)


class Detail(Enum):
    """How fine surface detail is made."""

    LEAN = 1
    """Two octaves of mottle and ripples; large vessels."""
    FULL = 2
    """Three octaves, and both sizes of vessel."""


@dataclass(frozen=True, slots=True)
class Effects:
    """Switch what light does beyond one surface; each costs time of its own.

    tool_shadow: tools take the scope's light, and bounced light, from the tissue.
    hairs: vibrissae stand on the skin inside the nostril.
    metal_mirror: metal shows the walls around it.
    film_mirror: the wet film shows other walls, most at grazing angles.
    thin_walls: light comes through a thin wall from its other side, and is lost there;
        a wall is mucosa, bone and mucosa, before a cell that sends some of it back.
    """

    tool_shadow: bool = True
    hairs: bool = True
    metal_mirror: bool = True
    film_mirror: bool = False
    thin_walls: bool = False

    @classmethod
    def none(cls) -> "Effects":
        """Switch everything off."""
        return cls(False, False, False, False, False)


class Tier(Enum):
    """Choose quality against time."""

    LIVE = (2, 256, Detail.LEAN, 1, Effects(), 8)
    FLIGHT = (2, 256, Detail.LEAN, 1, Effects(), 8, True)
    FULL = (6, 512, Detail.FULL, 1, Effects(film_mirror=True, thin_walls=True), 4)
    SNAPSHOT = (6, 1024, Detail.FULL, 2, Effects(film_mirror=True, thin_walls=True), 4)

    def __init__(
        self,
        sources: int,
        virtual_lights: int,
        detail: Detail,
        supersampling: int,
        effects: Effects,
        mirror_stride: int,
        half_light: bool = False,
    ) -> None:
        self.sources = sources
        self.virtual_lights = virtual_lights
        """Enough that none is seen to jump when its ray passes a rim: with 64 a cleft
        lit up by 50 codes from one frame to the next (`tests.steadiness`)."""
        self.detail = detail
        self.supersampling = supersampling
        """G-buffer pixels along the side of one picture pixel."""
        self.effects = effects
        self.mirror_stride = mirror_stride
        """G-buffer pixels between points from which mirrored light is followed."""
        self.half_light = half_light
        """Large pictures are lit at half their size; see `half_light`."""
