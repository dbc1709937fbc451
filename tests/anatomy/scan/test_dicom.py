"""DICOM folders written for the purpose, good and bad."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydicom import dcmread
from pydicom.dataset import FileDataset
from pydicom.uid import (
    UID,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    SecondaryCaptureImageStorage,
    generate_uid,
)

from anatomy.scan.dicom import choose_series, find_series, layout_notes, read_series
from anatomy.scan.scan import Modality, read_scan
from tests.dicom_files import write_slice, write_stack

SYNTAXES = ExplicitVRLittleEndian, ImplicitVRLittleEndian, ExplicitVRBigEndian


def test_a_folder_is_a_volume_in_hu_and_lps(tmp_path: Path) -> None:
    values = write_stack(tmp_path)
    (tmp_path / "notes.txt").write_text("not an image")
    (series,) = find_series(tmp_path).series
    assert str(series) == "CT, 8 slices of 10 x 12"
    volume, layout = read_series(choose_series([series], None))
    notes = layout_notes(layout, volume)
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
        volume, _ = read_series(choose_series(find_series(folder).series, None))
        bright = np.argwhere(volume.values > 0)[0][::-1]
        world = volume.world_from_voxel[:3, :3] @ bright + volume.origin_mm
        assert world == pytest.approx(6 * normal + 8 * row + 2 * column)


def test_padding_is_air_and_extreme_values_do_not_wrap(tmp_path: Path) -> None:
    for k in range(6):
        pixels = np.full((4, 4), 1064, np.int16)
        pixels[0, 0], pixels[1, 1], pixels[2, 2] = -2000, -32768, 32767
        place = np.array([0, 0, float(k)])
        write_slice(tmp_path / str(k), pixels, place, PixelPaddingValue=-2000)
    volume, _ = read_series(choose_series(find_series(tmp_path).series, None))
    slice_ = np.asarray(volume.values[2], dtype=float)
    assert slice_[0, 0] == -1000
    assert slice_[1, 1] == -32768 - 1024
    assert slice_[2, 2] == 32767 - 1024
    assert slice_[3, 3] == 40


@pytest.mark.parametrize(
    ("padding", "stored"), [(-2000, 63536), (63536, 63536), (65535, 65535)]
)
def test_padding_without_a_sign_is_air(
    tmp_path: Path, padding: int, stored: int
) -> None:
    for k in range(6):
        pixels = np.full((4, 4), 1064, np.uint16)
        pixels[0, 0] = stored
        place = np.array([0, 0, float(k)])
        write_slice(tmp_path / str(k), pixels, place, PixelRepresentation=0)
        image = dcmread(tmp_path / str(k))
        # scanners do not agree on the kind of its word
        image.add_new("PixelPaddingValue", "SS" if padding < 0 else "US", padding)
        image.save_as(tmp_path / str(k))
    volume, _ = read_series(find_series(tmp_path).series[0])
    assert volume.values[2, 0, 0] == -1000
    assert volume.values[2, 3, 3] == 40


@pytest.mark.parametrize("syntax", SYNTAXES)
@pytest.mark.parametrize("has_meta", [True, False])
@pytest.mark.parametrize("bare", [range(3), range(8)])
def test_files_without_preamble_are_slices_as_others(
    tmp_path: Path, syntax: UID, has_meta: bool, bare: range
) -> None:
    """As older archives wrote them; without a header they do not say how, either."""
    values = write_stack(tmp_path, syntax=syntax)
    for n in bare:
        content = (tmp_path / f"{n:03d}").read_bytes()[132:]
        header = 12 + int.from_bytes(content[8:12], "little")
        (tmp_path / f"{n:03d}").write_bytes(content[0 if has_meta else header :])
    volume, _ = read_series(choose_series(find_series(tmp_path).series, None))
    assert np.array_equal(volume.values, values - 1024)


def test_what_is_left_out_is_counted_by_kind(tmp_path: Path) -> None:
    write_stack(tmp_path / "a")
    write_stack(tmp_path / "b", 6, series="1.2.9", SeriesDescription="soft")
    for name in ("a.txt", "b.TXT", "VERSION"):
        (tmp_path / name).write_text("letter")
    # by chance as DICOM begins
    (tmp_path / "c.bin").write_bytes(b"\x08\0\x08\0\x04\0\0\0abcd")
    write_slice(tmp_path / "dose", np.zeros((4, 4), np.int16), np.zeros(3))
    dose = dcmread(tmp_path / "dose")
    dose.SOPClassUID = SecondaryCaptureImageStorage
    del dose.ImageOrientationPatient, dose.ImagePositionPatient
    dose.save_as(tmp_path / "dose")
    examination = find_series(tmp_path)
    assert sum(examination.left_out.values()) == 5
    first, second = examination.notes(examination.series[0])
    for words in ("2 .txt", "1 without an ending", "1 .bin", "1 Secondary Capture"):
        assert words in first
    assert "CT 'soft', 6 slices" in second


def test_copies_of_slices_are_left_out(tmp_path: Path) -> None:
    values = write_stack(tmp_path / "a")
    (tmp_path / "b").mkdir()
    for n in (1, 4):
        content = (tmp_path / "a" / f"{n:03d}").read_bytes()
        (tmp_path / "b" / f"copy {n}").write_bytes(content)
    examination = find_series(tmp_path)
    (series,) = examination.series
    volume, _ = read_series(series)
    assert np.array_equal(volume.values, values - 1024)
    assert any("2 copies of slices" in note for note in examination.notes(series))


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [
        (
            {"ConvolutionKernel": "B60s"},
            {"ConvolutionKernel": "B30s"},
            ("kernel B60s", "kernel B30s"),
        ),
        (
            {"AcquisitionNumber": 2, "AcquisitionTime": "101500"},
            {"AcquisitionNumber": 3, "AcquisitionTime": "101720"},
            ("acquisition 2", "acquisition 3"),
        ),
        ({"EchoTime": 12}, {"EchoTime": 80}, ("echo time 12", "echo time 80")),
        ({}, {"ContrastBolusAgent": "yes"}, ("contrast not told", "contrast yes")),
        (
            {"AcquisitionTime": "101500"},
            {"AcquisitionTime": "101720"},
            ("time 101500", "time 101720"),
        ),
    ],
)
def test_two_pictures_of_each_place_are_a_choice(
    tmp_path: Path,
    first: dict[str, Any],
    second: dict[str, Any],
    words: tuple[str, str],
) -> None:
    """Bone and soft kernel under one series are what ENT is sent every day."""
    values = write_stack(tmp_path / "a", **first)
    write_stack(tmp_path / "b", RescaleIntercept=-24, **second)
    series = find_series(tmp_path).series
    assert len(series) == 2
    with pytest.raises(ValueError, match="choose one: 1:") as told:
        choose_series(series, None)
    assert all(word in str(told.value) for word in words)
    for number, (word, offset) in enumerate(zip(words, (1024, 24), strict=True), 1):
        chosen = choose_series(series, number)
        assert word in str(chosen)
        assert np.array_equal(read_series(chosen)[0].values, values - offset)


def test_decimal_commas_are_points(tmp_path: Path) -> None:
    """They come from programs that write numbers as their user's country does."""
    values = write_stack(tmp_path, SliceThickness=2)
    for file in tmp_path.iterdir():
        content = file.read_bytes()
        for told in (b"0.5\\0.7 ", b"-30.0\\-20.0\\"):
            content = content.replace(told, told.replace(b".", b","))
        assert content != file.read_bytes()
        file.write_bytes(content)
    volume, _ = read_series(find_series(tmp_path).series[0])
    assert np.array_equal(volume.values, values - 1024)
    assert volume.spacing_mm == pytest.approx([0.7, 0.5, 2.0])
    assert volume.origin_mm == pytest.approx([-30, -20, 0])


def test_what_cannot_be_read_is_not_absent(tmp_path: Path) -> None:
    write_stack(tmp_path, SliceThickness=2)
    file = tmp_path / "003"
    content = file.read_bytes()
    file.write_bytes(content.replace(b"0.5\\0.7 ", b"0.5\\o.7 "))
    with pytest.raises(ValueError, match=r"003 has an unusable PixelSpacing: .*o\.7"):
        find_series(tmp_path)
    # a thickness is not needed
    at = content.index(b"\x18\0\x50\0DS") + 8
    file.write_bytes(content[:at] + b"x" + content[at + 1 :])
    assert read_series(find_series(tmp_path).series[0])[0].shape[0] == 8


def test_a_file_that_is_named_says_which_series(tmp_path: Path) -> None:
    write_stack(tmp_path, 8, series="1.2.1")
    for k in range(6):
        pixels = np.full((4, 4), 500 * (k % 3), np.int16)
        place = np.array([0, 0, float(k)])
        write_slice(tmp_path / f"b{k}", pixels, place, series="1.2.2")
    with pytest.raises(ValueError, match="choose one"):
        read_scan(tmp_path, modality=Modality.MR)
    assert read_scan(tmp_path / "b2", modality=Modality.MR).volume.shape == (6, 4, 4)
    assert read_scan(tmp_path / "001", modality=Modality.MR).volume.shape[0] == 8


def test_a_spacing_of_fewer_digits_parts_no_series(tmp_path: Path) -> None:
    for k in range(8):
        wide = (0.48828125, 0.488)[k % 2]
        pixels = np.full((4, 4), 100 * k, np.int16)
        place = np.array([0, 0, 2.0 * k])
        write_slice(tmp_path / str(k), pixels, place, spacing=(wide, wide))
    (series,) = find_series(tmp_path).series
    assert read_series(series)[0].shape == (8, 4, 4)


def test_mixed_series_are_listed_for_choice(tmp_path: Path) -> None:
    write_stack(tmp_path / "a", 8, series="1.2.1", SeriesDescription="bone")
    write_stack(tmp_path / "b", 6, series="1.2.2", SeriesDescription="soft")
    write_stack(tmp_path / "c", 2, series="1.2.3", SeriesDescription="scout")
    found = find_series(tmp_path).series
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
    (series,) = find_series(tmp_path).series
    with pytest.raises(ValueError, match=r"lacks 1 slices.*6\.0 mm.*allow"):
        read_series(series)
    volume, layout = read_series(series, allow_gaps=True)
    notes = layout_notes(layout, volume)
    assert any("bridged" in note for note in notes)
    assert volume.values[:, 0, 0] == pytest.approx(100 * np.arange(8) - 1024)


def edit(folder: Path, change: Callable[[FileDataset], None]) -> None:
    """Change one file of a stack, the one that is named 003."""
    image = dcmread(folder / "003")
    change(image)
    image.save_as(folder / "003")


def cut(folder: Path, size: int) -> None:
    """Keep the first bytes of the file 003."""
    file = folder / "003"
    file.write_bytes(file.read_bytes()[:size])


def lose(folder: Path, tag: str) -> None:
    """Take a field away from the file 003."""
    edit(folder, lambda image: image.__delattr__(tag))


def put(folder: Path, **fields: Any) -> None:
    """Put fields into the file 003."""

    def change(image: FileDataset) -> None:
        for name, value in fields.items():
            setattr(image, name, value)

    edit(folder, change)


CATALOGUE: dict[str, tuple[Callable[[Path], object], str]] = {
    "pixels cut off": (lambda f: cut(f, -100), "003 .*"),
    "no ImagePositionPatient": (
        lambda f: lose(f, "ImagePositionPatient"),
        "003 has no ImagePositionPatient",
    ),
    "no PixelSpacing": (lambda f: lose(f, "PixelSpacing"), "003 has no PixelSpacing"),
    "orientation of five numbers": (
        lambda f: put(f, ImageOrientationPatient=[1, 0, 0, 0, 1]),
        "003 has an unusable ImageOrientationPatient",
    ),
    "position that is no number": (
        lambda f: put(f, ImagePositionPatient=["nan", "0", "0"]),
        "003 has an unusable ImagePositionPatient",
    ),
    "many frames in one file": (
        lambda f: put(f, NumberOfFrames=4),
        "003 holds many frames.*one file a slice",
    ),
    "inverted values": (
        lambda f: put(f, PhotometricInterpretation="MONOCHROME1"),
        "003 is stored as MONOCHROME1",
    ),
    "colour": (
        lambda f: put(f, SamplesPerPixel=3, PhotometricInterpretation="RGB"),
        "003 is a colour image",
    ),
    "two images at one place": (
        lambda f: copied_anew(f),
        "two slices lie at .* choose one",
    ),
    "a slice missing": (lambda f: last_but_one(f).unlink(), "lacks 1 slices.*gaps"),
    "pixel spacing of zero": (
        lambda f: put_all(f, PixelSpacing=[0, 0]),
        "pixel spacing must be positive",
    ),
    "axes askew": (
        lambda f: put_all(f, ImageOrientationPatient=[1, 0, 0, 0.3, 1, 0]),
        "not at right angles",
    ),
    "a kind of value that there is not": (
        lambda f: unknown_kind(f),
        "003 cannot be read as a DICOM file: it is damaged",
    ),
    "images of a size that no memory holds": (
        lambda f: put_all(f, Rows=65535, Columns=65535),
        "needs [0-9,]+ bytes",
    ),
}
"""What a folder can be like, and what is said of it: the file, or the remedy."""


def copied_anew(folder: Path) -> None:
    """Add another picture of one place that nothing tells from the first."""
    image = dcmread(folder / "003")
    image.SOPInstanceUID = image.file_meta.MediaStorageSOPInstanceUID = generate_uid()
    image.save_as(folder / "again")


def last_but_one(folder: Path) -> Path:
    """Give the file of the slice next to the last one."""
    files = sorted(
        folder.iterdir(), key=lambda f: float(dcmread(f).ImagePositionPatient[2])
    )
    return files[-2]


def put_all(folder: Path, **fields: Any) -> None:
    """Put fields into every file."""
    for file in sorted(folder.iterdir()):
        image = dcmread(file)
        for name, value in fields.items():
            setattr(image, name, value)
        image.save_as(file)


def unknown_kind(folder: Path) -> None:
    """Change the kind of a field's value into one that there is not."""
    file = folder / "003"
    content = file.read_bytes()
    assert content.count(b"\x28\x00\x10\x00US") == 1
    file.write_bytes(content.replace(b"\x28\x00\x10\x00US", b"\x28\x00\x10\x00U!"))


@pytest.mark.filterwarnings("ignore::UserWarning")  # pydicom warns of such values
@pytest.mark.parametrize("row", CATALOGUE)
def test_a_wrong_folder_is_refused_in_one_sentence(tmp_path: Path, row: str) -> None:
    spoil, complaint = CATALOGUE[row]
    write_stack(tmp_path)
    spoil(tmp_path)
    with pytest.raises(ValueError, match=complaint) as told:
        read_scan(tmp_path)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("size", [140, 150, 260, 400])
def test_a_file_cut_in_its_header_is_no_lost_slice(tmp_path: Path, size: int) -> None:
    """Passed over, it would leave a hole, or at an end not even that."""
    write_stack(tmp_path)
    cut(tmp_path, size)
    with pytest.raises(ValueError, match="003 "):
        read_scan(tmp_path)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_any_byte_of_a_header_may_be_wrong(tmp_path: Path) -> None:
    """Each byte of one file set to another value: a volume, or a sentence."""
    write_stack(tmp_path)
    file = tmp_path / "003"
    content = file.read_bytes()
    rng = np.random.default_rng(7)
    header = content.index(b"\xe0\x7f\x10\x00")
    for place in rng.choice(np.arange(128, header + 12), 60, replace=False):
        spoiled = bytearray(content)
        spoiled[place] = int(rng.integers(256))
        file.write_bytes(spoiled)
        # anything but a ValueError is a traceback for whoever imports it
        with suppress(ValueError):
            read_series(choose_series(find_series(tmp_path).series, None))


@pytest.mark.parametrize("jitter", [1e-7, 2e-5])
def test_rounding_of_a_header_parts_no_series(tmp_path: Path, jitter: float) -> None:
    """On either side of a number that rounding to three places splits."""
    rng = np.random.default_rng(2)
    for k in range(8):
        pixels = np.full((4, 4), 100 * k, np.int16)
        lean, wide = 0.0005 + jitter * rng.uniform(-1, 1, 2)
        write_slice(
            tmp_path / str(k),
            pixels,
            np.array([0, 0, 2.0 * k]),
            orientation=(1, lean, 0, -lean, 1, 0),
            spacing=(0.5 + wide, 0.50005 + jitter * rng.uniform(-1, 1)),
        )
    (series,) = find_series(tmp_path).series
    assert read_series(series)[0].shape == (8, 4, 4)
    # what lies otherwise is another series all the same
    for k in range(5):
        place = np.array([0, 0, 2.0 * k])
        write_slice(
            tmp_path / f"t{k}", pixels, place, orientation=(1, 0, 0, 0, 0.96, 0.28)
        )
    assert [len(s.files) for s in find_series(tmp_path).series] == [8, 5]


@pytest.mark.parametrize(
    "lost",
    [(10, 12), (10, 12, 14, 16, 18), (4, 5, 6, 7, 8, 10), tuple(range(3, 25, 2))],
)
def test_several_gaps_are_refused_unless_allowed(
    tmp_path: Path, lost: tuple[int, ...]
) -> None:
    kept = [k for k in range(30) if k not in lost]
    for k in kept:
        pixels = np.full((4, 4), 50 * k, np.int16)
        write_slice(tmp_path / f"{k:02d}", pixels, np.array([0, 0, 2.0 * k]))
    (series,) = find_series(tmp_path).series
    before = 2.0 * (lost[0] - 1)
    with pytest.raises(
        ValueError,
        match=rf"lacks {len(lost)} slices: \d after the one at {before:.1f} mm",
    ):
        read_series(series)
    volume, layout = read_series(series, allow_gaps=True)
    notes = layout_notes(layout, volume)
    assert f"{len(lost)} missing slices bridged by interpolation" in notes
    assert volume.values[:, 0, 0] == pytest.approx(50 * np.arange(30) - 1024)


def test_thin_slices_far_apart_are_told(tmp_path: Path) -> None:
    write_stack(tmp_path, SliceThickness=1)
    volume, layout = read_series(find_series(tmp_path).series[0])
    (note,) = layout_notes(layout, volume)
    assert "slices of 1.00 mm lie 2.00 mm apart" in note


def test_every_slice_has_its_own_slope(tmp_path: Path) -> None:
    """Scanners rescale PET and MR slice by slice; nobody may take the first one's."""
    stored = np.full((6, 5), 100, np.int16)
    for k in range(6):
        place = np.array([0, 0, 2.0 * k])
        write_slice(
            tmp_path / str(k), stored, place, RescaleSlope=k + 1, RescaleIntercept=-k
        )
    volume, _ = read_series(find_series(tmp_path).series[0])
    assert volume.values[:, 3, 3] == pytest.approx(
        [100 * (k + 1) - k for k in range(6)]
    )


@given(tilt_deg=st.floats(-25, 25), seed=st.integers(0, 1000))
@settings(max_examples=6)
def test_a_tilted_uneven_folder_is_an_analytic_head(tilt_deg: float, seed: int) -> None:
    """From files to places: a linear field and a ball, wherever slices were cut."""
    rng = np.random.default_rng(seed)
    tilt = np.radians(tilt_deg)
    row = np.array([1.0, 0, 0])
    column = np.array([0, np.cos(tilt), np.sin(tilt)])
    # twice a step would look like a lost slice
    depth = np.cumsum(rng.uniform(1.1, 2.1, 28))
    middle = np.array([12.0, 14.0, float(depth[len(depth) // 2])])
    with TemporaryDirectory() as name:
        x, y = np.meshgrid(np.arange(40) * 0.7, np.arange(44) * 0.7)
        for k, z in enumerate(depth):
            # the table moves along z alone
            place = np.array([0.0, 0.0, float(f"{z:.4f}")])
            points = place + x[..., None] * row + y[..., None] * column
            ball = np.linalg.norm(points - middle, axis=-1)
            pixels = np.rint(100 * ball).astype(np.int16)
            write_slice(
                Path(name) / str(k),
                pixels,
                place,
                orientation=(*row, *column),
                spacing=(0.7, 0.7),
                RescaleIntercept=0,
            )
        volume, _ = read_series(find_series(Path(name)).series[0])
    for way in rng.normal(size=(40, 3)):
        # on a sphere of 6 mm the distance field is 6 mm, wherever it is sampled
        at = middle + 6.0 * way / np.linalg.norm(way)
        # interpolated over at most 2.2 mm and its curvature of 1/6 per mm
        assert float(volume.sample(at)) / 100 == pytest.approx(6.0, abs=0.13)


def test_no_images_at_all(tmp_path: Path) -> None:
    for n in range(400):
        (tmp_path / f"{n}.txt").write_text("letter")
    with pytest.raises(ValueError, match="400 files, none of which"):
        find_series(tmp_path)
