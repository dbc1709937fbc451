"""A patient's own scan: a file or a folder in, a volume in CT numbers out.

MR has no CT numbers. It is brought onto their scale by its two levels, air and soft
tissue; cortical bone is as dark as air there, so walls look thinner than they are.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from anatomy.files.volumes import as_image, read_volume
from anatomy.scan.dicom import (
    choose_series,
    find_series,
    layout_notes,
    read_series,
)
from anatomy.scan.dicom_folder import is_dicom
from anatomy.scan.slice_stack import StackLayout
from anatomy.tissue import SURFACE_HU, TISSUES
from renderers.scene.volume import AIR_HU, Volume
from system import UserError, simple_itk

ARCHIVES = (".zip", ".tar", ".tar.gz", ".tar.bz2", ".tar.xz", ".tgz", ".7z", ".rar")

LOWEST_HU = -1024.0
"""What is below lies outside the scanner's circle."""

NO_TISSUE = (-1500.0, 33_791.0)
"""Stored values of CT beyond these are no noise and no metal, but padding: -2000 and
-3024, and 63536, which is -2000 in words without a sign."""

CT_CONTRAST = (850.0, 1250.0)
"""Range of the step from air to soft tissue, in stored values, that tells CT."""

NOISE_MODES = 3.5
"""Air of an MR is noise; one voxel in 450 exceeds 3.5 times its mode. Half-way to
tissue, as in CT, would be wrong: a coil sees far tissue weakly."""

USUAL_OFFSET = 1024.0
"""Added to CT numbers where they are stored without a sign."""

WINDOW_FAR, WINDOW_LEAST, WINDOW_SHARE = 0.4, 40.0, 0.02
"""How far from zero, in steps from air to tissue and in stored values, and in which
share of voxels the lowest value tells a CT that was cut off."""

LISTED_VALUES = 4

SKULL_AIR, MOST_BONE_HU = (-1060.0, -940.0), 2500.0
"""Levels of a scan of nothing but air and bone: a skull, or a cast of one."""

TISSUE_HU = TISSUES["mucosa"].hu

Progress = Callable[[str, float], None]


class Modality(Enum):
    """Tell what the numbers mean."""

    CT = "CT"
    MR = "MR"


@dataclass(frozen=True, slots=True)
class Levels:
    """The two levels of a head's histogram, in its own units."""

    air: float
    tissue: float

    @classmethod
    def of(cls, volume: Volume) -> "Levels":
        """Find the levels on either side of the best threshold (Otsu 1979).

        Raises UserError for a volume that does not hold two levels.
        """
        values = np.asarray(volume.values, np.float32)[::2, ::2, ::2]
        # padding far below air would be taken for a level of its own
        return cls.of_values(np.maximum(values, LOWEST_HU))

    @classmethod
    def of_values(cls, values: NDArray[np.float32]) -> "Levels":
        """Find the levels of values in any order; see `of`."""
        low, high = np.percentile(values, (0.1, 99.9))
        if not high > low:
            raise UserError("the volume is the same everywhere")
        counts, edges = np.histogram(values, bins=512, range=(low, high))
        centers = (edges[:-1] + edges[1:]) / 2
        below = np.cumsum(counts)
        sums = np.cumsum(counts * centers)
        above = below[-1] - below
        with np.errstate(divide="ignore", invalid="ignore"):
            gap = sums / below - (sums[-1] - sums) / above
            between = np.where((below > 0) & (above > 0), below * above * gap**2, 0)
        # between two clean peaks every threshold is as good: take the middle one
        best = np.flatnonzero(between >= between.max() * (1 - 1e-12))
        cut = int(best[len(best) // 2]) + 1
        smooth = np.convolve(counts, np.ones(9) / 9, mode="same")
        return cls(
            float(centers[int(smooth[:cut].argmax())]),
            float(centers[cut + int(smooth[cut:].argmax())]),
        )


@dataclass(frozen=True, slots=True)
class Scan:
    """A patient's scan.

    volume: int16 CT numbers, or MR brought onto their scale, in LPS. notes: one
    sentence for each thing that was done to the data. step_mm: between the slices as
    they were taken, None where the grid's own says it. tilt_deg: of the gantry.
    lost_slices: how many were bridged.
    """

    volume: Volume
    modality: Modality
    notes: tuple[str, ...]
    step_mm: float | None = None
    tilt_deg: float = 0.0
    lost_slices: int = 0


def read_scan(
    path: Path,
    *,
    series: int | None = None,
    modality: Modality | None = None,
    allow_gaps: bool = False,
    nonfinite_is_air: bool = False,
    progress: Progress | None = None,
) -> Scan:
    """Read a DICOM folder, or an NRRD, NIfTI or MetaImage file.

    series: which of a folder's series, from 1. modality: None asks the header, then
    the histogram. Raises UserError, in one sentence, for what cannot be read rightly.
    """
    notes: list[str] = []
    stated: Modality | None = None
    layout: StackLayout | None = None
    if not path.exists():
        raise UserError(f"there is no file or folder {path}")
    if path.name.lower().endswith(ARCHIVES):
        raise UserError(f"{path} is an archive; unpack it and name what is inside")
    if path.is_dir() or is_dicom(path):
        folder = path if path.is_dir() else path.parent
        examination = find_series(folder, progress)
        chosen = choose_series(examination.series, series, path)
        volume, layout = read_series(chosen, allow_gaps=allow_gaps, progress=progress)
        notes = [*examination.notes(chosen), *layout_notes(layout, volume)]
        stated = _named(chosen.modality)
    else:
        if series is not None:
            raise UserError(
                f"{path} is a single volume: series {series} cannot be chosen from it; "
                "leave --series out"
            )
        volume, notes = read_volume(path)
    values, replaced = _finite(volume.values, nonfinite_is_air)
    if replaced:
        notes.append(f"{replaced:,} voxels that were no numbers are taken for air")
    volume = volume.with_values(values, volume.background)
    volume, padding = _without_padding(volume, modality or stated)
    kind = modality or stated or _guess(volume)
    result, note = _calibrated(volume, kind)
    if layout is None:
        return Scan(result, kind, (*notes, *padding, *note))
    return Scan(
        result,
        kind,
        (*notes, *padding, *note),
        step_mm=float(layout.steps_mm.max()),
        tilt_deg=layout.tilt_deg,
        lost_slices=sum(lost for _, lost in layout.missing()),
    )


def _without_padding(volume: Volume, kind: Modality | None) -> tuple[Volume, list[str]]:
    """Take what no tissue has for air, but in MR, whose numbers may be any.

    Where the kind is not known, high values are padding if they are all the same; low
    ones are if they are few.
    """
    values = np.asarray(volume.values)
    low, high = NO_TISSUE
    above = values > high
    if kind is Modality.MR or (kind is None and np.unique(values[above]).size > 1):
        return volume, []
    below = values < low
    if np.unique(values[below]).size > LISTED_VALUES:
        below &= False
    padding = above | below
    count = int(padding.sum())
    if not count or count == padding.size:
        return volume, []
    told = ", ".join(f"{v:g}" for v in np.unique(values[padding])[:LISTED_VALUES])
    lowest = values[~padding].min()
    return volume.with_values(np.where(padding, lowest, values), volume.background), [
        f"{count:,} voxels hold values that no tissue has ({told}); they are taken for "
        "air"
    ]


def _calibrated(volume: Volume, kind: Modality) -> tuple[Volume, list[str]]:
    """Bring stored values onto the scale of CT numbers."""
    levels = Levels.of(volume)
    contrast = levels.tissue - levels.air
    values = np.asarray(volume.values, dtype=np.float32)
    notes = []
    if kind is Modality.CT:
        # Soft tissue is the level to trust: air is often cut off at zero.
        usual = abs(levels.tissue - TISSUE_HU - USUAL_OFFSET) < 80
        offset = -USUAL_OFFSET if usual else TISSUE_HU - levels.tissue
        in_hu = levels.tissue > -200 and levels.tissue < 300 and levels.air < -800
        is_bone = SKULL_AIR[0] < levels.air < SKULL_AIR[1] and (
            300 <= levels.tissue < MOST_BONE_HU
        )
        in_hu = in_hu or is_bone
        if not in_hu and not CT_CONTRAST[0] < contrast < CT_CONTRAST[1]:
            values, note = _two_levels(values)
            notes.append(note)
        elif not in_hu:
            values = values + np.float32(offset)
            notes.append(f"stored values are CT numbers less {-offset:.0f}")
        values = np.maximum(values, np.float32(LOWEST_HU))
    else:
        # Rayleigh noise has its mode at the noise's own deviation.
        surface = levels.air * NOISE_MODES if levels.air > 0 else 0.25 * levels.tissue
        surface = min(surface, (levels.air + levels.tissue) / 2)
        known = [levels.air, surface, levels.tissue, 2 * levels.tissue - surface]
        hu = [AIR_HU, SURFACE_HU, TISSUE_HU, 2 * TISSUE_HU - SURFACE_HU]
        values = np.interp(values, known, hu).astype(np.float32)
        notes.append(
            f"MR: air at {levels.air:.0f}, its surface at {surface:.0f} and tissue at "
            f"{levels.tissue:.0f} are put on the scale of CT; bone is as dark as air "
            "and is taken for it"
        )
    limited = np.clip(np.rint(values), -32768, 32767).astype(np.int16)
    return volume.with_values(limited, AIR_HU), notes


def _two_levels(values: NDArray[np.float32]) -> tuple[NDArray[np.float32], str]:
    """Put grey values of a cone-beam CT on the scale of CT numbers, by air and tissue.

    Raises UserError where no air is left to go by.
    """
    some = values[::2, ::2, ::2]
    lowest = some.min()
    if np.mean(some == lowest) > WINDOW_SHARE:
        # what lies outside the field of view, or air that a window has cut off
        some = some[some > lowest]
    levels = Levels.of_values(some)
    contrast = levels.tissue - levels.air
    first = Levels.of_values(values[::2, ::2, ::2])
    if levels.air - lowest > 0.5 * (first.tissue - lowest) or contrast <= 0.0:
        raise UserError(
            f"these are no CT numbers, and cut off at {lowest:g}, where air should be: "
            f"tissue is at {first.tissue:.0f}; export the scan with all its numbers; "
            "if this is MR, say so"
        )
    scale = (TISSUE_HU - AIR_HU) / contrast
    middle = levels.air + contrast / 2
    # the mean of each level and its mode are one where the level is sharp
    off = max(
        abs(float(np.mean(some[some < middle])) - levels.air),
        abs(float(np.median(some[some >= middle])) - levels.tissue),
    )
    return (values - np.float32(levels.air)) * np.float32(scale) + np.float32(AIR_HU), (
        f"grey values are no CT numbers: air at {levels.air:.0f} and soft tissue at "
        f"{levels.tissue:.0f} are put at {AIR_HU:.0f} and {TISSUE_HU:.0f} HU, and what "
        f"lies between and beyond in proportion, some {off * scale:.0f} HU off"
    )


def _guess(volume: Volume) -> Modality:
    """Tell CT from MR by where air and tissue are."""
    levels = Levels.of(volume)
    contrast = levels.tissue - levels.air
    if levels.air < -800:
        return Modality.CT
    if _is_cut_off(volume, levels):
        low, high = volume.value_range
        raise UserError(
            f"the values are cut off at {low:g}, where air should be, as a window for "
            f"looking at CT does ({low:g} to {high:g}); export the CT with all its "
            "numbers, or say --modality mr if this is MR"
        )
    low, high = np.percentile(volume.values, (0.1, 99.9))
    # a raw CT's air stands near zero, its bone far above soft tissue
    is_raw = CT_CONTRAST[0] < contrast < CT_CONTRAST[1] and high - low > 1.8 * contrast
    return Modality.CT if is_raw and levels.air < 200 else Modality.MR


def _is_cut_off(volume: Volume, levels: Levels) -> bool:
    """Return whether a window took the air's own level away.

    No MR has its air far from zero, and all of it at exactly the lowest value.
    """
    lowest = volume.value_range[0]
    far = abs(levels.air) > max(WINDOW_FAR * (levels.tissue - levels.air), WINDOW_LEAST)
    share = np.mean(np.asarray(volume.values)[::2, ::2, ::2] == lowest)
    return far and float(share) > WINDOW_SHARE


def _named(modality: str) -> Modality | None:
    try:
        return Modality(modality)
    except ValueError as error:
        if modality in ("unknown", "OT", ""):
            return None
        raise UserError(
            f"the series is {modality}; only CT and MR can be imported"
        ) from error


def _finite(
    values: NDArray[np.generic], nonfinite_is_air: bool
) -> tuple[NDArray[np.generic], int]:
    if not np.issubdtype(values.dtype, np.floating):
        return values, 0
    bad = ~np.isfinite(values)
    count = int(bad.sum())
    if count and not nonfinite_is_air:
        raise UserError(
            f"{count:,} voxels are no numbers (NaN or infinite); say that they are "
            "air to import the rest"
        )
    if count == 0:
        return values, 0
    lowest = np.min(values, where=~bad, initial=np.inf)
    result: NDArray[np.generic] = np.where(bad, lowest, values)
    return result, count


def corners_of(volume: Volume) -> NDArray[np.float64]:
    """List the eight corners ``(8, 3)`` of a volume, LPS mm."""
    nz, ny, nx = volume.shape
    ends = np.array(np.meshgrid([0, nx - 1], [0, ny - 1], [0, nz - 1])).reshape(3, 8)
    matrix = volume.world_from_voxel
    corners: NDArray[np.float64] = (matrix[:3, :3] @ ends + matrix[:3, 3:]).T
    return corners


def patient_box(volume: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of the patient-aligned box around a volume."""
    corners = corners_of(volume)
    return corners.min(axis=0), corners.max(axis=0)


def inside(
    volume: Volume, points_mm: NDArray[np.float64], margin: float
) -> NDArray[np.bool_]:
    """Tell which points ``(n, 3)`` lie so many voxels within a volume's borders."""
    matrix = volume.voxel_from_world
    voxels = points_mm @ matrix[:3, :3].T + matrix[:3, 3]
    top = np.array(volume.shape[::-1]) - 1
    result: NDArray[np.bool_] = np.all(
        (voxels >= margin) & (voxels <= top - margin), axis=1
    )
    return result


def isotropic(
    volume: Volume,
    spacing_mm: float,
    low_mm: NDArray[np.float64],
    high_mm: NDArray[np.float64],
) -> Volume:
    """Sample a box of a volume on cubic voxels along the patient's own axes.

    low_mm, high_mm: corners of the box, LPS. Trilinear; outside is air. Raises
    UserError for a box that needs more memory than a workstation has.
    """
    sitk = simple_itk()
    count = np.maximum(np.ceil((high_mm - low_mm) / spacing_mm).astype(int) + 1, 2)
    if count.prod() > MOST_VOXELS:
        raise UserError(
            f"{count[0]} x {count[1]} x {count[2]} voxels of {spacing_mm:g} mm need "
            f"{count.prod() * 20 / 2**30:.0f} GiB; take a larger spacing"
        )
    sampled = sitk.Resample(
        as_image(volume),
        count.tolist(),
        sitk.Transform(),
        sitk.sitkLinear,
        low_mm.tolist(),
        [spacing_mm] * 3,
        np.eye(3).ravel().tolist(),
        AIR_HU,
        sitk.sitkFloat32,
    )
    values = sitk.GetArrayFromImage(sampled)
    return Volume(values, np.full(3, spacing_mm), low_mm, background=AIR_HU)


MOST_VOXELS = 300_000_000
"""About 6 GB of working memory."""
