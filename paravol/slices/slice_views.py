"""The three planes through a point of a head: CT, MR, or both in one picture.

Pictures lie as radiologists hang them: the patient's right is on the left of axial and
coronal pictures, the face on the left of sagittal ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from renderers.scene import TransferFunction, Volume, srgb_from_linear
from system import UserError

CT_WINDOW_HU = (-1000.0, 1400.0)
"""Black and white of a CT: a bone window, in which air and mucosa still differ."""

MR_SHARES = (1.0, 99.5)
"""Percentiles of an MR that become black and white."""

BONE_DEPTH_MM = 0.08
"""Depth over which the transfer function's bone covers an MR in the fused picture."""

SECOND = ("mr", "t1", "t2")
"""Volumes beside the CT, the first of them is shown."""


@dataclass(frozen=True, slots=True)
class GrayWindow:
    """Which CT numbers are black and white, HU: width and middle of the range."""

    name: str
    width: float
    level: float

    @property
    def ends(self) -> tuple[float, float]:
        """Return what is black and what is white."""
        return self.level - self.width / 2, self.level + self.width / 2

    def moved(self, wider: float, brighter: float) -> "GrayWindow":
        """Return it wider by HU, and its middle lower by HU: all becomes brighter."""
        width = min(max(self.width + wider, NARROWEST_HU), WIDEST_HU)
        level = min(max(self.level - brighter, -WIDEST_HU / 2), WIDEST_HU / 2)
        return GrayWindow("own", width, level)

    def text(self) -> str:
        """Return its name, width and level."""
        return f"{self.name} {self.width:.0f}/{self.level:.0f}"


NARROWEST_HU, WIDEST_HU = 20.0, 6000.0

GRAY_WINDOWS = (
    GrayWindow("air to bone", CT_WINDOW_HU[1] - CT_WINDOW_HU[0], sum(CT_WINDOW_HU) / 2),
    GrayWindow("bone", 2000.0, 350.0),
    GrayWindow("soft tissue", 350.0, 40.0),
)
"""To choose from; the first is what one begins with."""


class Plane(Enum):
    """Name a plane by the array axis it is cut across."""

    AXIAL = 0
    CORONAL = 1
    SAGITTAL = 2

    @property
    def letters(self) -> tuple[str, str, str, str]:
        """Return what is at the left, right, top and bottom of the picture."""
        return _LETTERS[self]


_LETTERS = {
    Plane.AXIAL: ("R", "L", "A", "P"),
    Plane.CORONAL: ("R", "L", "S", "I"),
    Plane.SAGITTAL: ("A", "P", "S", "I"),
}


class Show(Enum):
    """Which scan a slice shows."""

    CT = "ct"
    MR = "mr"
    BOTH = "both"

    def next(self) -> "Show":
        """Return the one that a switch goes on to."""
        every = list(Show)
        return every[(every.index(self) + 1) % len(every)]


@dataclass(frozen=True, slots=True)
class SliceViews:
    """Cut pictures out of a head's volumes.

    ct: CT numbers on cubic voxels along the patient's axes. transfer: what of the CT
    is bone, and its colour. second: an MR on the same grid; window: its black and
    white.
    """

    ct: Volume
    transfer: TransferFunction
    second: Volume | None = None
    window: tuple[float, float] = (0.0, 1.0)

    @classmethod
    def of(
        cls, volumes: Mapping[str, Volume], transfer: TransferFunction
    ) -> "SliceViews":
        """Take the CT and the first other scan of a case's volumes."""
        ct = volumes["ct"]
        if not np.array_equal(ct.direction, np.eye(3)):
            raise UserError("slices are cut along the patient's axes, ct.nrrd is not")
        second = next((volumes[n] for n in SECOND if n in volumes), None)
        if second is None:
            return cls(ct, transfer)
        low, high = np.percentile(np.asarray(second.values)[::2, ::2, ::2], MR_SHARES)
        return cls(ct, transfer, second, (float(low), max(float(high), low + 1e-6)))

    def picture(
        self,
        plane: Plane,
        at_mm: NDArray[np.float64],
        show: Show,
        ct_window_hu: tuple[float, float] = CT_WINDOW_HU,
    ) -> NDArray[np.uint8]:
        """Return the slice nearest to a point, ``(h, w, 3)`` sRGB, a voxel a pixel.

        ct_window_hu: black and white of the CT. Raises UserError for MR where the case
        has none.
        """
        ct = cut(self.ct, plane, at_mm)
        if show is Show.CT:
            return _gray(ct, ct_window_hu)
        if self.second is None:
            raise UserError(
                "the case has no second scan; import it with --second, or make the "
                "phantom with --mr"
            )
        gray = _gray(cut(self.second, plane, at_mm), self.window)
        return gray if show is Show.MR else self._with_bone(gray, ct)

    def place(self, plane: Plane, at_mm: NDArray[np.float64]) -> tuple[float, float]:
        """Return the column and the row of a point in a plane's picture."""
        i, j, k = (np.asarray(at_mm) - self.ct.origin_mm) / self.ct.spacing_mm
        top = self.ct.shape[0] - 1
        places = {
            Plane.AXIAL: (i, j),
            Plane.CORONAL: (i, top - k),
            Plane.SAGITTAL: (j, top - k),
        }
        column, row = places[plane]
        return float(column), float(row)

    def found(
        self, plane: Plane, column: float, row: float, at_mm: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the point ``(3,)`` at a column and a row of a plane's picture.

        at_mm: where the plane is cut. What `place` gives leads back to the point.
        """
        at = (np.asarray(at_mm, np.float64) - self.ct.origin_mm) / self.ct.spacing_mm
        top = self.ct.shape[0] - 1
        if plane is Plane.AXIAL:
            at[:2] = column, row
        else:
            at[0 if plane is Plane.CORONAL else 1] = column
            at[2] = top - row
        found: NDArray[np.float64] = at * self.ct.spacing_mm + self.ct.origin_mm
        return self.within(found)

    def within(self, at_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the point of the scan that is nearest to a point."""
        ends = self.ct.spacing_mm * (np.array(self.ct.shape[::-1]) - 1)
        origin = self.ct.origin_mm
        nearest: NDArray[np.float64] = np.clip(at_mm, origin, origin + ends)
        return nearest

    def stepped(
        self, plane: Plane, at_mm: NDArray[np.float64], slices: float
    ) -> NDArray[np.float64]:
        """Return a point so many slices on: upwards, to the back, or to the left."""
        axis = 2 - plane.value
        point = np.array(at_mm, np.float64)
        point[axis] += slices * self.ct.spacing_mm[axis]
        return self.within(point)

    def _with_bone(
        self, gray: NDArray[np.uint8], ct: NDArray[np.generic]
    ) -> NDArray[np.uint8]:
        """Lay what the transfer function takes for bone over soft tissue from MR."""
        numbers = np.arange(np.asarray(ct).min(), np.asarray(ct).max() + 1)
        color, kappa = self.transfer.evaluate(numbers.astype(np.float64))
        soft = np.median(self.transfer.kappa_per_mm[self.transfer.kappa_per_mm > 0][:2])
        cover = -np.expm1(-np.maximum(kappa - soft, 0.0) * BONE_DEPTH_MM)
        index = np.asarray(ct, np.int64) - int(numbers[0])
        share = cover[index][..., None]
        bone = 255.0 * srgb_from_linear(color)[index]
        mixed = (1 - share) * gray + share * bone
        result: NDArray[np.uint8] = np.rint(mixed).astype(np.uint8)
        return result


def cut(
    volume: Volume, plane: Plane, at_mm: NDArray[np.float64]
) -> NDArray[np.generic]:
    """Return a volume's slice nearest to a point, as it hangs; within the volume."""
    at = (np.asarray(at_mm) - volume.origin_mm) / volume.spacing_mm
    axis = plane.value
    number = int(np.clip(round(float(at[2 - axis])), 0, volume.shape[axis] - 1))
    found: NDArray[np.generic] = np.take(volume.values, number, axis)
    return found if plane is Plane.AXIAL else found[::-1]


def _gray(
    values: NDArray[np.generic], window: tuple[float, float]
) -> NDArray[np.uint8]:
    low, high = window
    share = (np.asarray(values, np.float32) - low) / (high - low)
    gray = np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)
    result: NDArray[np.uint8] = np.repeat(gray[..., None], 3, axis=2)
    return result
