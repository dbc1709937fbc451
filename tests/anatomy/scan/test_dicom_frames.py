"""Enhanced DICOM: many slices in one file, placed by functional groups."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydicom import Dataset, dcmread
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.encaps import encapsulate, generate_frames
from pydicom.uid import (
    EnhancedCTImageStorage,
    ExplicitVRLittleEndian,
    JPEG2000Lossless,
    generate_uid,
)

from anatomy.scan.dicom import choose_series, find_series, layout_notes, read_series
from anatomy.scan.scan import Modality, read_scan

ROW, COLUMN = np.array([0.0, 1, 0]), np.array([0.28, 0.0, -0.96])
NORMAL = np.cross(ROW, COLUMN)
SHAPE = (8, 12, 10)


def group(**fields: dict[str, Any]) -> Dataset:
    """Make a functional group of sequences with one item each."""
    made = Dataset()
    for name, values in fields.items():
        item = Dataset()
        for key, value in values.items():
            setattr(item, key, value)
        setattr(made, name, [item])
    return made


def stored() -> NDArray[np.int16]:
    return np.random.default_rng(5).integers(0, 3000, SHAPE).astype(np.int16)


def enhanced(order: NDArray[np.int_], **per_frame: Any) -> FileDataset:
    """Make an enhanced CT of slices 2 mm apart, in an order that is not their own.

    per_frame: further groups, each a function of the slice's own number.
    """
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = EnhancedCTImageStorage
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    image = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    image.SOPClassUID = EnhancedCTImageStorage
    image.SOPInstanceUID = meta.MediaStorageSOPInstanceUID
    image.SeriesInstanceUID, image.Modality = "1.2.3", "CT"
    image.NumberOfFrames = len(order)
    image.Rows, image.Columns = SHAPE[1:]
    image.BitsAllocated = image.BitsStored = 16
    image.HighBit, image.PixelRepresentation = 15, 1
    image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
    image.SharedFunctionalGroupsSequence = [
        group(
            PlaneOrientationSequence={"ImageOrientationPatient": [*ROW, *COLUMN]},
            PixelMeasuresSequence={"PixelSpacing": [0.5, 0.7], "SliceThickness": 2},
            PixelValueTransformationSequence={
                "RescaleSlope": 1,
                "RescaleIntercept": -1024,
            },
        )
    ]
    image.PerFrameFunctionalGroupsSequence = [
        group(
            PlanePositionSequence={
                "ImagePositionPatient": [
                    float(f"{v:.6g}") for v in (-30, -20, 5) + 2.0 * k * NORMAL
                ]
            },
            **{name: value(int(k)) for name, value in per_frame.items()},
        )
        for k in order
    ]
    image.PixelData = stored()[order].tobytes()
    return image


def write(image: FileDataset, file: Path) -> None:
    file.parent.mkdir(exist_ok=True)
    image.save_as(file, enforce_file_format=True)


ORDER = np.random.default_rng(1).permutation(SHAPE[0])


def test_an_enhanced_file_is_a_volume(tmp_path: Path) -> None:
    write(enhanced(ORDER), tmp_path / "scan")
    (series,) = find_series(tmp_path).series
    assert str(series) == "CT, 8 slices of 10 x 12"
    volume, layout = read_series(series)
    notes = layout_notes(layout, volume)
    assert np.array_equal(volume.values, stored() - 1024)
    assert volume.spacing_mm == pytest.approx([0.7, 0.5, 2.0])
    assert volume.origin_mm == pytest.approx([-30, -20, 5])
    assert volume.direction == pytest.approx(np.stack([ROW, COLUMN, NORMAL], 1))
    assert notes == []
    # named as a file, too
    assert read_scan(tmp_path / "scan", modality=Modality.MR).volume.shape == SHAPE


def test_every_frame_has_its_own_slope(tmp_path: Path) -> None:
    def scale(k: int) -> dict[str, float]:
        return {"RescaleSlope": k + 1, "RescaleIntercept": -k}

    write(enhanced(ORDER, PixelValueTransformationSequence=scale), tmp_path / "scan")
    volume, _ = read_series(find_series(tmp_path).series[0])
    k = np.arange(SHAPE[0])[:, None, None]
    assert np.array_equal(volume.values, stored() * (k + 1.0) - k)


def test_a_concatenation_is_one_series(tmp_path: Path) -> None:
    """Large enhanced images are cut into several files."""
    write(enhanced(ORDER[:3]), tmp_path / "b")
    write(enhanced(ORDER[3:]), tmp_path / "a")
    volume, _ = read_series(choose_series(find_series(tmp_path).series, None))
    assert np.array_equal(volume.values, stored() - 1024)


def test_stacks_and_phases_are_listed_apart(tmp_path: Path) -> None:
    twice = np.concatenate([ORDER, ORDER])
    image = enhanced(twice)
    for n, frame in enumerate(image.PerFrameFunctionalGroupsSequence):
        content = Dataset()
        content.StackID, content.TemporalPositionIndex = "1", 1 + n // len(ORDER)
        frame.FrameContentSequence = [content]
    write(image, tmp_path / "scan")
    with pytest.raises(ValueError, match="several series, choose one: 1: CT, 8"):
        read_scan(tmp_path)
    volume, _ = read_series(choose_series(find_series(tmp_path).series, 2))
    assert np.array_equal(volume.values, stored() - 1024)


def test_a_lost_frame_is_a_lost_slice(tmp_path: Path) -> None:
    write(enhanced(ORDER[ORDER != 4]), tmp_path / "scan")
    with pytest.raises(ValueError, match="lacks 1 slices: 1 after the one"):
        read_series(find_series(tmp_path).series[0])


def test_compressed_frames_are_decoded(tmp_path: Path) -> None:
    """SimpleITK packs each slice, and unpacks it out of a file of many."""
    sitk = importlib.import_module("SimpleITK")
    plain = enhanced(ORDER)
    pieces = []
    for k in ORDER:
        single = tmp_path / "single.dcm"
        writer = sitk.ImageFileWriter()
        writer.SetFileName(str(single))
        writer.UseCompressionOn()
        writer.SetCompressor("JPEG2000")
        writer.Execute(sitk.GetImageFromArray(stored()[k : k + 1]))
        packed = dcmread(single)
        assert packed.file_meta.TransferSyntaxUID == JPEG2000Lossless
        pieces += list(generate_frames(packed.PixelData, number_of_frames=1))
        single.unlink()
    plain.file_meta.TransferSyntaxUID = JPEG2000Lossless
    plain.PixelData = encapsulate(pieces)
    plain["PixelData"].VR = "OB"
    write(plain, tmp_path / "scan")
    volume, _ = read_series(find_series(tmp_path).series[0])
    assert np.array_equal(volume.values, stored() - 1024)


def spoiled(image: FileDataset, row: str) -> None:
    """Do to an enhanced image what a row of the catalogue names."""
    own = image.PerFrameFunctionalGroupsSequence
    if row == "no groups":
        del image.PerFrameFunctionalGroupsSequence
        del image.SharedFunctionalGroupsSequence
    elif row == "no orientation":
        del image.SharedFunctionalGroupsSequence[0].PlaneOrientationSequence
    elif row == "no position":
        del own[3].PlanePositionSequence
    elif row == "more frames listed than there are":
        image.NumberOfFrames = len(own) - 2
        image.PixelData = image.PixelData[: -2 * 2 * SHAPE[1] * SHAPE[2]]
    elif row == "pixels cut off":
        image.PixelData = image.PixelData[:-600]


CATALOGUE = {
    "no groups": "scan holds many frames in one file.*one file a slice",
    "no orientation": "scan holds many frames in one file.*one file a slice",
    "no position": "scan has no ImagePositionPatient",
    "more frames listed than there are": "scan is cut off: its header lists slice",
    "pixels cut off": r"scan is cut off: [\d,]+ of [\d,]+ bytes",
}


@pytest.mark.parametrize("row", CATALOGUE)
def test_what_lacks_its_place_is_refused(tmp_path: Path, row: str) -> None:
    image = enhanced(ORDER)
    spoiled(image, row)
    write(image, tmp_path / "scan")
    with pytest.raises(ValueError, match=CATALOGUE[row]) as told:
        read_scan(tmp_path)
    assert "\n" not in str(told.value)
