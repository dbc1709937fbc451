"""Headers that claim what cannot be: each is refused in one sentence."""

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from SimpleITK import GetImageFromArray, WriteImage

from anatomy.files import volume_header
from anatomy.files.volumes import load_volume, save_volume
from renderers.scene.volume import Volume
from tests.anatomy.volume_files import VALUES, write_volume


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"sizes": "1000000 1000000 1000"}, r"needs 2,000,000,000,000,000 bytes"),
        ({"sizes": "100 10 1"}, "100 x 10 x 1 voxels"),
        ({"sizes": "100 10 0"}, "cannot be read"),
        ({"space_directions": "(0,0,0) (0,1,0) (0,0,1)"}, "unusable spacing"),
        ({"space_directions": "(nan,nan,nan) (0,1,0) (0,0,1)"}, "axis that is"),
        ({"space_directions": "(inf,0,0) (0,1,0) (0,0,1)"}, ""),
        ({"space_directions": "(1e-6,0,0) (0,1,0) (0,0,1)"}, "another unit"),
        ({"space_directions": "(1,0,0) (1,0,0) (0,0,1)"}, "right angles"),
        ({"space_directions": "(1,0,0) (.3,1,0) (0,0,1)"}, "right angles"),
        ({"space": "scanner-xyz"}, "left and right are unknown"),
        (
            {
                "space": "",
                "space_directions": "",
                "space_origin": "",
                "spacings": "1 1 2",
            },
            "left and right are unknown",
        ),
        (
            {
                "space": "",
                "space_directions": "",
                "space_origin": "",
                "spacings": "-1 1 2",
            },
            "negative spacing",
        ),
        ({"type": "block", "block_size": "2"}, "cannot be read"),
        (
            {
                "dimension": "4",
                "sizes": "10 10 5 2",
                "space_directions": "(1,0,0) (0,1,0) (0,0,1) none",
                "kinds": "space space space list",
            },
            "",
        ),
        ({"sizes": "10 10 11"}, "damaged"),
        ({"encoding": "bzip2"}, ""),
    ],
)
def test_a_wrong_header_is_refused(
    tmp_path: Path, fields: dict[str, str], complaint: str
) -> None:
    file = tmp_path / "scan.nrrd"
    write_volume(file, **fields)
    with pytest.raises(ValueError, match=rf"scan\.nrrd.*{complaint}") as told:
        load_volume(file)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("space", "axes", "expected"),
    [
        ("left-posterior-superior", "(1,0,0) (0,1,0) (0,0,1)", (1, 1, 1)),
        ("right-anterior-superior", "(1,0,0) (0,1,0) (0,0,1)", (-1, -1, 1)),
        ("left-anterior-superior", "(1,0,0) (0,1,0) (0,0,1)", (1, -1, 1)),
        # a mirrored array is legal: its header says so
        ("left-posterior-superior", "(-1,0,0) (0,1,0) (0,0,1)", (-1, 1, 1)),
    ],
)
def test_left_is_where_the_header_says(
    tmp_path: Path, space: str, axes: str, expected: tuple[int, int, int]
) -> None:
    file = tmp_path / "scan.nrrd"
    write_volume(file, space=space, space_directions=axes, space_origin="(0,0,0)")
    volume = load_volume(file)
    assert np.array_equal(volume.direction, np.diag(expected))
    # the voxel (3, 2, 1) in x, y, z order
    place = volume.world_from_voxel @ np.array([3, 2, 1, 1])
    assert place[:3] == pytest.approx(np.multiply(expected, (3, 2, 1)))
    assert volume.sample(place[:3]) == volume.values[1, 2, 3]


def nifti(tmp_path: Path) -> tuple[Path, bytearray]:
    file = tmp_path / "scan.nii"
    save_volume(Volume(VALUES.reshape(10, 10, 10), np.ones(3), np.zeros(3)), file)
    return file, bytearray(file.read_bytes())


def test_a_nifti_that_claims_too_much_is_refused(tmp_path: Path) -> None:
    file, content = nifti(tmp_path)
    struct.pack_into("<4h", content, 40, 3, 32000, 32000, 32000)
    file.write_bytes(content)
    need = re.escape(f"{32000**3 * 2:,} bytes")
    with pytest.raises(ValueError, match=need):
        load_volume(file)


@pytest.mark.parametrize("ending", ["nrrd", "nii.gz", "mha"])
def test_a_small_file_that_unpacks_to_gigabytes_is_refused(
    tmp_path: Path, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(volume_header, "EXPANDED_BYTES", 1 << 20)
    file = tmp_path / f"scan.{ending}"
    empty = np.zeros((100, 100, 100), np.int16)
    save_volume(Volume(empty, np.ones(3), np.zeros(3)), file)
    with pytest.raises(ValueError, match=rf"{ending} says .* unpack to 2,000,000;"):
        load_volume(file)
    noise = np.random.default_rng(0).integers(0, 99, empty.shape).astype(np.int16)
    save_volume(Volume(noise, np.ones(3), np.zeros(3)), file)
    assert np.array_equal(load_volume(file).values, noise)


def test_a_nifti_without_its_place_is_refused(tmp_path: Path) -> None:
    file, content = nifti(tmp_path)
    struct.pack_into("<2h", content, 252, 0, 0)
    file.write_bytes(content)
    with pytest.raises(ValueError, match="qform and sform are 0"):
        load_volume(file)


def test_a_time_series_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "film.nii.gz"
    film = np.zeros((3, 5, 6, 7), np.int16)
    WriteImage(GetImageFromArray(film, isVector=False), str(file))
    with pytest.raises(ValueError, match=r"film\.nii\.gz.*4 dimensions"):
        load_volume(file)


@pytest.mark.parametrize("ending", ["nrrd", "nii.gz", "nii", "mha"])
def test_a_cut_file_is_refused(tmp_path: Path, ending: str) -> None:
    noise = np.random.default_rng(0).integers(0, 99, (12, 13, 14))
    file = tmp_path / f"scan.{ending}"
    save_volume(Volume(noise.astype(np.int16), np.ones(3), np.zeros(3)), file)
    file.write_bytes(file.read_bytes()[:-700])
    with pytest.raises(ValueError, match=rf"scan\.{ending}"):
        load_volume(file)


def test_complex_numbers_are_no_scan(tmp_path: Path) -> None:
    file = tmp_path / "k.mha"
    image = GetImageFromArray(np.zeros((5, 6, 7), np.complex64))
    WriteImage(image, str(file))
    with pytest.raises(ValueError, match=r"k\.mha"):
        load_volume(file)


KINDS = {
    "int8": "signed char",
    "uint8": "uchar",
    "int16": "short",
    "uint16": "ushort",
    "int32": "int",
    "float32": "float",
    "float64": "double",
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("endian", ["little", "big"])
def test_every_kind_of_number_is_the_same_volume(
    tmp_path: Path, kind: str, endian: str
) -> None:
    values = np.random.default_rng(4).integers(0, 100, (10, 10, 10))
    file = tmp_path / "scan.nrrd"
    write_volume(file, type=KINDS[kind], endian=endian)
    header = file.read_bytes()[: -VALUES.nbytes]
    ordered = values.astype(np.dtype(kind).newbyteorder("<"))
    if endian == "big":
        ordered = ordered.byteswap()
    file.write_bytes(header + ordered.tobytes())
    volume = load_volume(file)
    assert volume.values.dtype == np.dtype(kind)
    assert np.array_equal(volume.values, values)
