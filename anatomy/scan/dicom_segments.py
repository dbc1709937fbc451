"""Segmentations of DICOM, as OHIF, 3D Slicer and dcmqi write them.

highdicom reads all three kinds: binary, fractional and label maps.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from anatomy.scan.dicom_folder import is_dicom, read_dicom
from anatomy.scan.dicom_frames import kind_of
from renderers.scene.memory_limit import memory_limit
from renderers.scene.volume import Volume
from system import UserError, foreign_file

SEGMENTATIONS = "1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"
"""Of segmentations: those of bits or bytes, and label maps."""

HALF = 0.5
"""A fraction from which a voxel counts as inside."""


def read_segments(
    path: Path, wanted: Callable[[str], bool]
) -> tuple[dict[str, Volume], list[str]] | None:
    """Return the voxels, 0 or 1, of the wanted segments by label, and other labels.

    None for a file that is not DICOM. All lie on one grid. Two of one label are one.
    Raise UserError for other files of DICOM: they name no structures.
    """
    if not path.is_file() or not is_dicom(path):
        return None
    with foreign_file(path, "a DICOM file"):
        image = read_dicom(path)
        kind = kind_of(image)
        what = "of no kind" if kind is None else kind.name
    if kind not in SEGMENTATIONS:
        raise UserError(
            f"{path} is DICOM, but no segmentation ({what}); give the SEG file, or a "
            "label map as NRRD or NIfTI"
        )
    # a second to import, and few need it
    from highdicom.seg import Segmentation

    with foreign_file(path, "a DICOM segmentation"):
        read = Segmentation.from_dataset(image, copy=False)
        labels = {
            number: str(read.get_segment_description(number).segment_label)
            for number in read.segment_numbers
        }
        numbers = [number for number, label in labels.items() if wanted(label)]
        others = [label for label in labels.values() if not wanted(label)]
        if not numbers:
            return {}, others
        grid = read.get_volume_geometry()
        if grid is None:
            raise UserError(f"{path} holds slices that are no volume")
        needed = len(numbers) * int(np.prod(grid.spatial_shape, dtype=np.float64))
        if needed > memory_limit():
            raise UserError(
                f"{path} unpacks to {needed:,} bytes; at most {memory_limit():,} may "
                "be taken"
            )
        held = read.get_volume(segment_numbers=numbers)
        # planes, rows and columns are z, y and x of the array
        spacing = np.array(held.spacing)
        axes = np.array(held.affine)[:3, :3] / spacing
        found: dict[str, Volume] = {}
        for n, number in enumerate(numbers):
            values = (held.array[..., n] >= HALF).astype(np.uint8)
            # slices without a voxel are left out of files, at times all but one
            values = np.pad(values, [(0, max(2 - size, 0)) for size in values.shape])
            label = labels[number]
            if label in found:
                values |= found[label].values
            found[label] = Volume(
                values, spacing[::-1], held.affine[:3, 3], axes[:, ::-1], 0.0
            )
    return found, others
