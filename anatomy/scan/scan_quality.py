"""How good a scan is, and what each shortcoming takes away.

All is measured in the values and their grid; a header's word on kernel or dose is not
asked for.
"""

import math

import numpy as np

from anatomy.case import QualityRecord
from anatomy.scan.imported import ImportedHead
from anatomy.scan.scan import Modality, Scan, inside
from anatomy.scan.wall_estimate import edge_blur_mm
from anatomy.tissue import Label
from renderers.scene.volume import Volume

HALF_SHOWN = 1.349
"""Thickness, in deviations of the blur, at which a membrane's middle is half as dense
as it is: ``erf(t / (2 sqrt(2) s)) = 1/2``. A thinner one counts as air."""

CELL_WALL_MM = 1.0
"""Between ethmoid cells: 0.25 mm of bone with 0.4 mm of mucosa on both sides."""

NOISY_HU = 60.0
"""Three deviations then span the surface's distance of 520 HU to air in one voxel of
three hundred, and mucus (15 HU) is not told from mucosa (40 HU) at all."""

BLOCK = 8
"""Edge, in pixels of a slice, of the squares that noise is measured in."""

TISSUE_HU, SPAN_HU = (0.0, 100.0), 8.0
"""Means of squares of soft tissue; a square that spans more deviations than noise of 64
pixels does holds an edge."""

LEAST_BLOCKS = 30

EVEN_SHARE = 30.0
"""Percentile of the squares' deviations: tissue has a texture of its own, so that the
evener ones are nearer to noise alone."""

TILT_DEG = 1.0

CUT_SHARE = 0.02
"""Of a sinus's voxels that lie at the scan's border where it is cut."""

ROOF_MM, FRONT_MM = (0.0, -25.0, 52.0), (0.0, -48.0, 62.0)
"""Left, back and up of the choana's floor: above the ethmoid's roof, and in the frontal
sinuses."""

CLIPPED_SHARE, HIGHEST_HU = 2e-4, 3000.0
"""Share of voxels at the very highest value that tells a cut; scanners of 12 bits end
at 3071 by themselves."""

METAL_HU, METAL_MM3 = 2800.0, 30.0
"""Enamel has up to 2500 HU; what is denser is a filling or an implant."""


def scan_quality(scan: Scan, head: ImportedHead) -> tuple[QualityRecord, ...]:
    """List what was measured of a scan, each with what it limits."""
    found = [_walls(scan, head)]
    if scan.lost_slices:
        found.append(
            QualityRecord(
                name="lost slices",
                value=float(scan.lost_slices),
                told=f"{scan.lost_slices} slices are missing",
                limits="what lay in them is made up of their neighbours: do not "
                "measure or score across them",
            )
        )
    if abs(scan.tilt_deg) >= TILT_DEG:
        found.append(
            QualityRecord(
                name="gantry tilt",
                value=scan.tilt_deg,
                told=f"the gantry was tilted by {scan.tilt_deg:.1f} degrees",
                limits="the slices were moved to where they were in the patient: edges "
                "across them are softened by up to a pixel",
            )
        )
    if scan.modality is Modality.CT:
        found += [*_noise(scan.volume), *_view(scan, head), *_numbers(scan.volume)]
    return tuple(found)


def noise_hu(volume: Volume) -> float | None:
    """Return the standard deviation of noise in even soft tissue, HU.

    Of squares of 8 x 8 pixels that hold no edge. None where there are too few.
    """
    values = np.asarray(volume.values)
    nz, ny, nx = (
        n // BLOCK * BLOCK if axis else n for axis, n in enumerate(values.shape)
    )
    kept = values[:nz, :ny, :nx].astype(np.float32)
    squares = kept.reshape(nz, ny // BLOCK, BLOCK, nx // BLOCK, BLOCK)
    squares = squares.swapaxes(2, 3).reshape(-1, BLOCK * BLOCK)
    means = squares.mean(axis=1)
    squares = squares[(means > TISSUE_HU[0]) & (means < TISSUE_HU[1])]
    if not len(squares):
        return None
    spread = squares.std(axis=1, ddof=1)
    even = np.ptp(squares, axis=1) <= SPAN_HU * np.percentile(spread, EVEN_SHARE)
    if np.count_nonzero(even) < LEAST_BLOCKS:
        return None
    return float(np.percentile(spread[even], EVEN_SHARE))


def thinnest_wall_mm(blur_mm: float, step_mm: float = 0.0) -> float:
    """Return the thickness of the thinnest membrane that is still told from air.

    blur_mm: standard deviation of an edge in the slices. step_mm: between slices, for a
    membrane that lies along them.
    """
    return HALF_SHOWN * math.hypot(blur_mm, step_mm / math.sqrt(12.0))


def _walls(scan: Scan, head: ImportedHead) -> QualityRecord:
    spacing = scan.volume.spacing_mm
    step = scan.step_mm or float(spacing[2])
    told = (
        f"pixels of {spacing[0]:.2f} x {spacing[1]:.2f} mm, slices {step:.2f} mm apart"
    )
    if scan.modality is Modality.MR:
        return QualityRecord(
            name="slice step",
            value=step,
            told=told,
            limits="in MR bone looks like air: walls of bone are not shown at all",
        )
    blur = edge_blur_mm(head.ct, head.distance)
    across, along = thinnest_wall_mm(blur), thinnest_wall_mm(blur, step)
    told += (
        f"; edges are {blur:.2f} mm wide (standard deviation): membranes show from "
        f"{across:.1f} mm, along the slices from {along:.1f} mm"
    )
    limits = ""
    if max(across, along) > CELL_WALL_MM:
        limits = (
            f"walls between ethmoid cells ({CELL_WALL_MM:g} mm) are not all shown: a "
            "way between cells may be open where there is bone"
        )
    return QualityRecord(name="slice step", value=step, told=told, limits=limits)


def _noise(volume: Volume) -> list[QualityRecord]:
    noise = noise_hu(volume)
    if noise is None:
        return []
    limits = ""
    if noise > NOISY_HU:
        limits = (
            "mucus and mucosa are not told apart, and walls of mucosa alone may have "
            "holes or grow specks"
        )
    told = f"{noise:.0f} HU of noise in soft tissue (standard deviation)"
    return [QualityRecord(name="noise", value=noise, told=told, limits=limits)]


def _view(scan: Scan, head: ImportedHead) -> list[QualityRecord]:
    """Say what of the nose and its sinuses lies outside the scan."""
    found = []

    def cut(name: str, told: str, limits: str) -> None:
        found.append(QualityRecord(name=name, value=1.0, told=told, limits=limits))

    if not any(name.startswith("nostril") for name in head.landmarks):
        cut(
            "face",
            "no nostril is in view: the face is cut off or the nose is blocked",
            "the scope does not enter as in a patient: the vestibule and the valve "
            "cannot be trained",
        )
    frame = head.named.frame
    if frame is None:
        cut(
            "nasal floor",
            "the nasal floor below the septum is not in view, or was not found",
            "no sinus is named, and the lower passages may be missing",
        )
    else:
        for name, place, limits in (
            ("skull base", ROOF_MM, "distances to it are unknown"),
            ("frontal sinuses", FRONT_MM, "frontal sinuses and recess are incomplete"),
        ):
            at = frame.origin_mm + np.array(place) @ frame.axes
            if not inside(scan.volume, at[None], 0.0)[0]:
                cut(name, f"the scan ends below the {name}", limits)
    labels = head.labels
    for value, name in (
        (Label.MAXILLARY_AIR, "maxillary"),
        (Label.FRONTAL_AIR, "frontal"),
        (Label.SPHENOID_AIR, "sphenoid"),
    ):
        voxels = np.argwhere(labels.values == value)[:, ::-1]
        points = labels.origin_mm + voxels * labels.spacing_mm
        if len(points) and np.mean(~inside(scan.volume, points, 1.5)) > CUT_SHARE:
            cut(
                f"{name} sinuses",
                f"the {name} sinuses reach the border of the scan",
                "their volumes are too small, and their walls there are not the "
                "patient's",
            )
    return found


def _numbers(volume: Volume) -> list[QualityRecord]:
    """Tell numbers that were cut off, and metal."""
    values = np.asarray(volume.values)
    highest = float(values.max())
    share = float(np.mean(values == highest))
    found = []
    if share > CLIPPED_SHARE and highest < HIGHEST_HU:
        found.append(
            QualityRecord(
                name="clipping",
                value=highest,
                told=f"values end at {highest:.0f} HU, which {100 * share:.2g} % of "
                "the voxels have: they were cut off",
                limits="dense bone and teeth look alike, and thick walls are not "
                "judged by their density",
            )
        )
    metal = float(np.count_nonzero(values >= METAL_HU) * np.prod(volume.spacing_mm))
    if metal > METAL_MM3:
        found.append(
            QualityRecord(
                name="metal",
                value=metal,
                told=f"{metal:.0f} mm3 are denser than enamel: fillings or implants",
                limits="streaks beside them look like walls or like air, mostly at the "
                "height of the teeth",
            )
        )
    return found
