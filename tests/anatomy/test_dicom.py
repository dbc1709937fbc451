"""DICOM folders written for the purpose, good and bad."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import UID, ExplicitVRLittleEndian, generate_uid

from anatomy.dicom import choose_series, find_series, read_series

CT = UID("1.2.840.10008.5.1.4.1.1.2")


def write_slice(
    file: Path,
    pixels: NDArray[np.int16],
    position: NDArray[np.float64],
    *,
    series: str = "1.2.3",
    orientation: tuple[float, ...] = (1, 0, 0, 0, 1, 0),
    spacing: tuple[float, float] = (0.5, 0.7),
    **more: Any,
) -> None:
    """Write a slice; spacing is between rows, between columns, as in the standard."""
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = CT
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    image = FileDataset(str(file), {}, file_meta=meta, preamble=b"\0" * 128)
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
    image.PixelData = pixels.tobytes()
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


def test_a_folder_is_a_volume_in_hu_and_lps(tmp_path: Path) -> None:
    values = write_stack(tmp_path)
    (tmp_path / "notes.txt").write_text("not an image")
    (series,) = find_series(tmp_path)
    assert str(series) == "CT, 8 slices of 10 x 12"
    volume, notes = read_series(choose_series([series], None))
    assert np.array_equal(volume.values, values - 1024)
    assert volume.values.dtype == np.int16
    assert volume.spacing_mm == pytest.approx([0.7, 0.5, 2.0])
    assert volume.origin_mm == pytest.approx([-30, -20, 0])
    assert notes == []


def test_left_stays_left_whatever_the_slices_orientation(tmp_path: Path) -> None:
    """A bright voxel near the patient's left is there after reading."""
    pixels = np.zeros((8, 10, 10), np.int16)
    pixels[3, 2, 8] = 2000
    for name, axes in (
        ("feet first", (-1, 0, 0, 0, 1, 0)),
        ("coronal", (1, 0, 0, 0, 0, -1)),
        ("sagittal", (0, 1, 0, 0, 0, -1)),
    ):
        folder = tmp_path / name
        folder.mkdir()
        row, column = np.array(axes[:3], float), np.array(axes[3:], float)
        normal = np.cross(row, column)
        for k in range(8):
            write_slice(
                folder / str(k), pixels[k], 2.0 * k * normal, orientation=axes,
                spacing=(1, 1),
            )  # fmt: skip
        volume, _ = read_series(choose_series(find_series(folder), None))
        bright = np.argwhere(volume.values > 0)[0][::-1]
        world = volume.world_from_voxel[:3, :3] @ bright + volume.origin_mm
        assert world == pytest.approx(6 * normal + 8 * row + 2 * column)


def test_padding_is_air_and_extreme_values_do_not_wrap(tmp_path: Path) -> None:
    for k in range(6):
        pixels = np.full((4, 4), 1064, np.int16)
        pixels[0, 0], pixels[1, 1], pixels[2, 2] = -2000, -32768, 32767
        place = np.array([0, 0, float(k)])
        write_slice(tmp_path / str(k), pixels, place, PixelPaddingValue=-2000)
    volume, _ = read_series(choose_series(find_series(tmp_path), None))
    slice_ = np.asarray(volume.values[2], dtype=float)
    assert slice_[0, 0] == -1000
    assert slice_[1, 1] == -32768 - 1024
    assert slice_[2, 2] == 32767 - 1024
    assert slice_[3, 3] == 40


def test_mixed_series_are_listed_for_choice(tmp_path: Path) -> None:
    write_stack(tmp_path / "a", 8, series="1.2.1", SeriesDescription="bone")
    write_stack(tmp_path / "b", 6, series="1.2.2", SeriesDescription="soft")
    write_stack(tmp_path / "c", 2, series="1.2.3", SeriesDescription="scout")
    found = find_series(tmp_path)
    assert [len(s.files) for s in found] == [8, 6, 2]
    with pytest.raises(ValueError, match=r"choose one: 1: CT 'bone'.*2: CT 'soft'"):
        choose_series(found, None)
    assert choose_series(found, 2).description == "soft"
    with pytest.raises(ValueError, match="no series 9"):
        choose_series(found, 9)
    # without the second volume the scout is no choice
    assert choose_series([found[0], found[2]], None) is found[0]


def test_a_lost_slice_is_refused_unless_allowed(tmp_path: Path) -> None:
    for k in (0, 1, 2, 3, 5, 6, 7):
        pixels = np.full((4, 4), 100 * k, np.int16)
        write_slice(tmp_path / str(k), pixels, np.array([0, 0, 2.0 * k]))
    (series,) = find_series(tmp_path)
    with pytest.raises(ValueError, match=r"lacks 1 slices.*6\.0 mm.*allow"):
        read_series(series)
    volume, notes = read_series(series, allow_gaps=True)
    assert any("bridged" in note for note in notes)
    assert volume.values[:, 0, 0] == pytest.approx(100 * np.arange(8) - 1024)


def test_damage_is_named_with_its_file(tmp_path: Path) -> None:
    write_stack(tmp_path)
    victim = tmp_path / "003"
    whole = victim.read_bytes()
    victim.write_bytes(whole[:-100])
    (series,) = find_series(tmp_path)
    with pytest.raises(ValueError, match=r"003 .*"):
        read_series(series)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"NumberOfFrames": 4}, "many frames"),
        ({"PhotometricInterpretation": "MONOCHROME1"}, "MONOCHROME1"),
        ({"SamplesPerPixel": 3}, "colour"),
    ],
)
def test_what_is_no_slice_of_numbers_is_refused(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    write_stack(tmp_path, 6, **change)
    with pytest.raises(ValueError, match=message):
        read_series(find_series(tmp_path)[0])


def test_no_images_at_all(tmp_path: Path) -> None:
    for n in range(30):
        (tmp_path / f"{n}.txt").write_text("letter")
    with pytest.raises(ValueError, match="30 files, none of which"):
        find_series(tmp_path)
