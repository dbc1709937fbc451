"""A scan and its labels as DICOM: a series of CT or MR images, and a segmentation."""

import hashlib
import re
from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import (
    UID,
    CTImageStorage,
    ExplicitVRLittleEndian,
    MRImageStorage,
)

from anatomy.files.segments import STRUCTURE, code_of, color_of
from renderers.scene.volume import Volume
from system import whole_file

if TYPE_CHECKING:
    from highdicom.seg import Segmentation

MAKER, MODEL = "PARAVOL", "paravol export"
SEGMENTS = "segmentation.dcm"


def write_dicom(
    folder: Path, scan: Volume, labels: Volume, names: Mapping[int, str], patient: str,
    *, is_mr: bool, version: str, made: datetime,
) -> Iterator[tuple[float, Path]]:  # fmt: skip
    """Write a scan slice by slice, then its labels; give the done share and each file.

    scan: whole numbers, HU where it is no MR. labels: on the scan's grid. names: by the
    labels' values; what has none is left out, and so is 0. patient: the name and number
    that files bear. Numbers of series and images follow from their content.
    """
    seed = hashlib.sha256(np.ascontiguousarray(scan.values).data).hexdigest() + patient
    slices = []
    for number in range(scan.shape[0]):
        image = _slice(scan, number, seed, patient, is_mr=is_mr, made=made)
        file = folder / f"slice-{number + 1:04}.dcm"
        with whole_file(file) as beside:
            image.save_as(beside, enforce_file_format=True)
        slices.append(image)
        yield 0.7 * (number + 1) / scan.shape[0], file
    there = {int(value) for value in np.unique(labels.values)}
    named = {value: names[value] for value in sorted(there) if value and value in names}
    if named:
        made_of = _segmentation(slices, labels, named, seed, version)
        with whole_file(folder / SEGMENTS) as beside:
            made_of.save_as(beside, enforce_file_format=True)
        yield 1.0, folder / SEGMENTS


def _uid(*words: str) -> UID:
    """Return a number, of 128 bits, that the same words give again."""
    digest = hashlib.sha256("\n".join(words).encode()).digest()
    return UID(f"2.25.{int.from_bytes(digest[:16], 'big')}")


def _slice(
    scan: Volume, number: int, seed: str, patient: str, *, is_mr: bool, made: datetime
) -> FileDataset:
    kind = MRImageStorage if is_mr else CTImageStorage
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = kind
    meta.MediaStorageSOPInstanceUID = _uid(seed, "slice", str(number))
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    image = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    image.SpecificCharacterSet = "ISO_IR 192"
    image.SOPClassUID = kind
    image.SOPInstanceUID = meta.MediaStorageSOPInstanceUID
    image.StudyInstanceUID = _uid(seed, "study")
    image.SeriesInstanceUID = _uid(seed, "series")
    image.FrameOfReferenceUID = _uid(seed, "frame")
    image.Modality = "MR" if is_mr else "CT"
    image.ImageType = ["DERIVED", "SECONDARY", "AXIAL"]
    image.Manufacturer, image.ManufacturerModelName = MAKER, MODEL
    # signs that part names and values in DICOM; a part that ends is a family name
    known_as = re.sub(r"[\\^=\x00-\x1f]", " ", patient)[:60]
    image.PatientName, image.PatientID = f"{known_as}^", known_as
    image.StudyDate = image.SeriesDate = image.ContentDate = made.strftime("%Y%m%d")
    image.StudyTime = image.SeriesTime = image.ContentTime = made.strftime("%H%M%S")
    for empty in (
        *("PatientBirthDate", "PatientSex", "StudyID", "AccessionNumber"),
        *("ReferringPhysicianName", "PositionReferenceIndicator", "PatientPosition"),
        *("AcquisitionNumber", "KVP"),
    ):
        setattr(image, empty, None)
    if is_mr:
        del image.KVP
        image.ScanningSequence, image.SequenceVariant = "RM", "NONE"
        image.MRAcquisitionType, image.ScanOptions = "3D", None
        image.RepetitionTime = image.EchoTime = image.EchoTrainLength = None
    image.SeriesNumber, image.InstanceNumber = 1, number + 1
    x, y, z = scan.direction.T
    spacing = [float(v) for v in scan.spacing_mm]
    place = scan.origin_mm + number * spacing[2] * z
    # decimal strings hold sixteen characters
    image.ImagePositionPatient = [f"{v:.9g}" for v in place]
    image.ImageOrientationPatient = [f"{v:.9g}" for v in (*x, *y)]
    image.PixelSpacing = [f"{spacing[1]:.9g}", f"{spacing[0]:.9g}"]
    image.SliceThickness = f"{spacing[2]:.9g}"
    image.Rows, image.Columns = scan.shape[1:]
    image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
    image.BitsAllocated = image.BitsStored = 16
    image.HighBit, image.PixelRepresentation = 15, 1
    if not is_mr:
        image.RescaleSlope, image.RescaleIntercept, image.RescaleType = 1, 0, "HU"
    values = np.clip(np.rint(scan.values[number]), -32768, 32767).astype("<i2")
    image.PixelData = values.tobytes()
    return image


def _segmentation(
    slices: list[FileDataset], labels: Volume, named: Mapping[int, str], seed: str,
    version: str,
) -> "Segmentation":  # fmt: skip
    # a second to import, and few need it
    from highdicom import AlgorithmIdentificationSequence
    from highdicom.color import CIELabColor
    from highdicom.seg import Segmentation, SegmentDescription
    from highdicom.sr.coding import CodedConcept
    from pydicom.sr.codedict import codes

    numbers = np.zeros(int(labels.values.max()) + 1, np.uint8)
    described = []
    way = AlgorithmIdentificationSequence(MODEL, codes.DCM.HistogramAnalysis, version)
    for number, (value, name) in enumerate(named.items(), start=1):
        numbers[value] = number
        kind, what = (
            CodedConcept(code, "SCT", told) for code, told in (STRUCTURE, code_of(name))
        )
        red, green, blue = (round(255 * share) for share in color_of(number - 1))
        described.append(
            SegmentDescription(
                *(number, name[:64], kind, what, "AUTOMATIC"),
                algorithm_identification=way,
                display_color=CIELabColor.from_rgb(red, green, blue),
            )
        )
    return Segmentation(
        source_images=slices,
        pixel_array=numbers[labels.values],
        segmentation_type="BINARY",
        segment_descriptions=described,
        series_instance_uid=_uid(seed, "segments"),
        series_number=2,
        sop_instance_uid=_uid(seed, "segmentation"),
        instance_number=1,
        manufacturer=MAKER,
        manufacturer_model_name=MODEL,
        software_versions=version,
        device_serial_number="1",
    )
