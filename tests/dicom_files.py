"""DICOM folders written for tests, as scanners write them."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import UID, ExplicitVRLittleEndian, generate_uid

CT = UID("1.2.840.10008.5.1.4.1.1.2")


def write_slice(
    file: Path,
    pixels: NDArray[np.int16] | NDArray[np.uint16],
    position: NDArray[np.float64],
    *,
    series: str = "1.2.3",
    orientation: tuple[float, ...] = (1, 0, 0, 0, 1, 0),
    spacing: tuple[float, float] = (0.5, 0.7),
    syntax: UID = ExplicitVRLittleEndian,
    **more: Any,
) -> None:
    """Write a slice; spacing is between rows, between columns, as in the standard."""
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = CT
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = syntax
    image = FileDataset(
        str(file),
        {},
        file_meta=meta,
        preamble=b"\0" * 128,
        is_implicit_VR=syntax.is_implicit_VR,
        is_little_endian=syntax.is_little_endian,
    )
    image.SOPClassUID = CT
    image.SOPInstanceUID = meta.MediaStorageSOPInstanceUID
    image.SeriesInstanceUID = series
    image.Modality = "CT"
    image.Rows, image.Columns = pixels.shape
    image.BitsAllocated = image.BitsStored = 16
    image.HighBit = 15
    image.PixelRepresentation = 1
    image.SamplesPerPixel = 1
    image.PhotometricInterpretation = "MONOCHROME2"
    image.ImagePositionPatient = [float(f"{v:.6g}") for v in position]
    image.ImageOrientationPatient = list(orientation)
    image.PixelSpacing = list(spacing)
    image.RescaleSlope, image.RescaleIntercept = 1, -1024
    image.PixelData = pixels.astype(
        pixels.dtype.newbyteorder("<" if syntax.is_little_endian else ">")
    ).tobytes()
    for name, value in more.items():
        setattr(image, name, value)
    image.save_as(file, enforce_file_format=True)


def write_stack(folder: Path, count: int = 8, **more: Any) -> NDArray[np.int16]:
    """Write slices 2 mm apart in an order that is not their own."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(5)
    values = rng.integers(0, 3000, (count, 12, 10)).astype(np.int16)
    for n, k in enumerate(rng.permutation(count)):
        place = np.array([-30.0, -20.0, 2.0 * k])
        write_slice(folder / f"{n:03d}", values[k], place, **more)
    return values
