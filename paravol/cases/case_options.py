"""What a case is made of, and how. Nothing heavy is imported here."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, kw_only=True, slots=True)
class ImportOptions:
    """Set how a scan becomes a case."""

    out: Path
    """Folder for the case, which 3D Slicer opens."""
    series: int | None = None
    """Which series of a folder that holds several."""
    modality: Literal["ct", "mr"] | None = None
    """What the numbers mean, where the file does not say and the guess is wrong."""
    spacing: float = 0.5
    """Voxel edge in millimetres."""
    pivot: tuple[float, float, float] | None = None
    """Where the scope enters: x y z in millimetres, patient LPS; a nostril when left
    out."""
    second: Path | None = None
    """A second scan of the same head, CT or MR; it is registered to the first."""
    labels: Path | None = None
    """A label map of the scan, as 3D Slicer (.seg.nrrd) or TotalSegmentator (NIfTI)
    write it: what in it must not be hurt is measured."""
    label_names: str | None = None
    """What the labels' values are, where their file does not say: a TotalSegmentator
    task (head_glands_cavities, craniofacial_structures, headneck_bones_vessels) or a
    JSON file, such as nnU-Net's dataset.json."""
    allow_gaps: bool = False
    """Bridge missing slices by interpolation."""
    nonfinite_air: bool = False
    """Take voxels that are no numbers for air."""
    force: bool = False
    """Write over the case, and its exercise, that the folder holds."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PhantomOptions:
    """Choose a virtual patient."""

    out: Path
    """Folder for ct.nrrd, labels.seg.nrrd, landmarks.mrk.json and case.json."""
    scene: str = ""
    """Write an abstract scene to practise in instead: hoops, niches, path or targets;
    of the other options only the seed, the spacing and --force are its own."""
    average: bool = False
    """Take the average adult instead; the seed then draws the cells alone."""
    variant: tuple[str, ...] = ()
    """Add a variant, such as onodi:left, haller or keros-3; may be repeated."""
    without: tuple[str, ...] = ()
    """Remove a variant, such as agger-nasi:right; may be repeated."""
    lund_mackay: tuple[str, ...] = ()
    """Add disease, such as maxillary:left=2,ostiomeatal:left=2 or polyps=3."""
    disease: tuple[str, ...] = ()
    """Add disease or traces of surgery: fluid:maxillary:left=0.4 (share of the sinus),
    swelling:frontal=2 (mm), cyst:maxillary:right=8 (radius in mm),
    antrostomy:right=90 (mm^2), polyps=2 (grade); may be repeated."""
    congestion: float | None = None
    """How swollen turbinates and mucosa are, from 0, decongested, to 1; drawn when left
    out."""
    posture: Literal["supine", "upright"] | None = None
    """How the head lay in the scanner, which sets where fluid stands; supine when left
    out."""
    spacing: float = 0.5
    """Voxel edge in millimetres."""
    noise: float = 12.0
    """Standard deviation of the CT's noise in HU: 12 of a soft kernel, 50 of bone."""
    mr: bool = False
    """Write t1.nrrd and t2.nrrd too."""
    force: bool = False
    """Write over the case that the folder holds."""
