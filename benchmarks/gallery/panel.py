"""One picture of the gallery, and the family of pictures it belongs to."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import NasalView
from renderers.scene import srgb_from_linear, ssim

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Panel:
    """A picture with its figures.

    who: its column. pixels: ``(h, w, 3)`` sRGB. cpu_s: CPU seconds of one picture;
    None where the picture is not right, so that its time does not count. error: in
    the family's unit, against its reference. alike: SSIM of the encoded pictures. why:
    what is wrong with it; "" where nothing is.
    """

    who: str
    pixels: Picture
    cpu_s: float | None
    error: float
    alike: float
    why: str = ""


@dataclass(frozen=True, slots=True)
class Absent:
    """Why a column has no picture of a view."""

    who: str
    why: str


@dataclass(frozen=True, slots=True)
class Family:
    """What a sheet shows.

    name: of its file. columns: who draws, the reference last. reference: what errors
    are against. unit: of the errors, in words. told: what a reader must know.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    reference: str
    unit: str
    told: str


class Studio(Protocol):
    """Draw a family's pictures of one view after the other."""

    @property
    def family(self) -> Family:
        """Return what it draws."""
        ...

    def draw(self, view: NasalView) -> list[Panel | Absent]:
        """Return a panel for each column, in their order."""
        ...

    def close(self) -> None:
        """End child processes and threads."""
        ...


def encoded(linear: NDArray[np.floating]) -> Picture:
    """Return linear light of which 1 is white as sRGB codes."""
    return np.rint(255 * srgb_from_linear(linear)).astype(np.uint8)


def likeness(a: Picture, b: Picture) -> float:
    """Return SSIM; 1 for what has the same bits, however small."""
    return 1.0 if np.array_equal(a, b) else ssim(a, b)
