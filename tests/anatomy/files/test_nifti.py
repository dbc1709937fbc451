"""NIfTI files as hospitals' converters write them: rescaled, with two frames."""

import gzip
import struct
from pathlib import Path

import numpy as np
import pytest

from anatomy.files.volumes import load_volume, read_volume, save_volume
from anatomy.scan.scan import Modality, read_scan
from renderers.scene.volume import Volume


def head() -> Volume:
    """A box of tissue in air, with a shell of bone, in CT numbers."""
    hu = np.full((20, 24, 28), -1000.0)
    hu[3:17, 3:21, 3:25] = 900.0
    hu[4:16, 4:20, 4:24] = 40.0
    hu[8:12, 8:12, 8:12] = -1000.0
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    place = np.array([-30.0, 20, 7])
    return Volume(hu.astype(np.int16), np.array([0.5, 0.5, 1.25]), place, turn)


def write(file: Path) -> bytearray:
    """Write the head as int16 with slope 1 and intercept -1024; gives the bytes."""
    volume = head()
    values = np.asarray(volume.values)
    save_volume(volume.with_values((values + 1024).astype(np.int16), 0.0), file)
    content = bytearray(file.read_bytes())
    struct.pack_into("<2f", content, 112, 1.0, -1024.0)
    file.write_bytes(content)
    return content


@pytest.mark.parametrize("ending", ["nii", "nii.gz"])
def test_a_rescaled_ct_is_no_cut_file(tmp_path: Path, ending: str) -> None:
    """The reader announces floats, twice the bytes that the file has."""
    content = write(tmp_path / "a.nii")
    file = tmp_path / f"scan.{ending}"
    file.write_bytes(gzip.compress(content) if ending == "nii.gz" else content)
    assert np.array_equal(load_volume(file).values, head().values)
    scan = read_scan(file)
    assert scan.modality is Modality.CT
    assert np.array_equal(scan.volume.values, head().values)
    assert scan.notes == ()
    short = content[:-700]
    file.write_bytes(gzip.compress(short) if ending == "nii.gz" else short)
    with pytest.raises(ValueError, match=r"is cut off: [\d,]+ of [\d,]+ bytes"):
        load_volume(file)


def test_frames_that_agree_are_not_spoken_of(tmp_path: Path) -> None:
    file = tmp_path / "a.nii"
    write(file)
    volume, notes = read_volume(file)
    assert volume.world_from_voxel == pytest.approx(head().world_from_voxel, abs=1e-4)
    assert notes == []


def test_frames_that_disagree_are_told(tmp_path: Path) -> None:
    file = tmp_path / "a.nii"
    content = write(file)
    # the fourth number of the first row: 12 mm to one side
    (x,) = struct.unpack_from("<f", content, 280 + 12)
    struct.pack_into("<f", content, 280 + 12, x + 12.0)
    file.write_bytes(content)
    (note,) = read_scan(file).notes
    assert "qform and sform of a.nii disagree by up to 12.0 mm" in note
    assert "the sform is taken" in note
    away = read_scan(file).volume.origin_mm - head().origin_mm
    assert away == pytest.approx([-12, 0, 0], abs=1e-3)


def test_frames_that_exchange_the_sides_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.nii"
    content = write(file)
    row = struct.unpack_from("<4f", content, 280)
    struct.pack_into("<4f", content, 280, *(-v for v in row))
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.nii .* left and right are unknown"):
        read_scan(file)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    ("offset", "count", "frame"),
    [(76, 4, "qform"), (256, 6, "qform"), (280, 12, "sform")],
)
def test_a_frame_that_is_not_finite_is_refused(
    tmp_path: Path, offset: int, count: int, frame: str, number: float
) -> None:
    """The last of them is the one by which ITK's reader never came back."""
    content = write(tmp_path / "a.nii")
    for place in range(offset, offset + 4 * count, 4):
        broken = bytearray(content)
        struct.pack_into("<f", broken, place, number)
        (tmp_path / "a.nii").write_bytes(broken)
        with pytest.raises(ValueError, match=rf"a\.nii has a {frame} .* not finite"):
            load_volume(tmp_path / "a.nii")


def test_a_pair_of_files_is_checked_by_its_header(tmp_path: Path) -> None:
    content = write(tmp_path / "a.nii")
    content[344:347] = b"ni1"
    struct.pack_into("<f", content, 108, 0.0)
    (tmp_path / "a.hdr").write_bytes(content[:352])
    (tmp_path / "a.img").write_bytes(content[352:])
    assert np.array_equal(load_volume(tmp_path / "a.img").values, head().values)
    struct.pack_into("<f", content, 280, np.nan)
    (tmp_path / "a.hdr").write_bytes(content[:352])
    for name in ("a.img", "a.hdr"):
        with pytest.raises(ValueError, match=r"a\.hdr has a sform .* not finite"):
            load_volume(tmp_path / name)


def test_what_places_no_voxel_may_hold_anything(tmp_path: Path) -> None:
    content = write(tmp_path / "a.nii")
    # lengths along axes that are not there, and a frame that is not used
    struct.pack_into("<4f", content, 92, *[np.nan] * 4)
    struct.pack_into("<h", content, 254, 0)
    struct.pack_into("<12f", content, 280, *[np.nan] * 12)
    (tmp_path / "a.nii").write_bytes(content)
    assert load_volume(tmp_path / "a.nii").origin_mm == pytest.approx(
        head().origin_mm, abs=1e-4
    )


def test_a_header_that_says_two_orders_of_bytes_is_refused(tmp_path: Path) -> None:
    """Its length says one, its number of dimensions the other."""
    content = write(tmp_path / "a.nii")
    struct.pack_into(">h", content, 40, 3)
    (tmp_path / "a.nii").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.nii .* 768 dimensions"):
        load_volume(tmp_path / "a.nii")


@pytest.mark.parametrize("packed", ["", ".gz"])
def test_a_pair_may_be_packed(tmp_path: Path, packed: str) -> None:
    content = write(tmp_path / "a.nii")
    content[344:347] = b"ni1"
    struct.pack_into("<f", content, 108, 0.0)
    pack = gzip.compress if packed else bytes
    (tmp_path / "B.HDR").write_bytes(content[:352])
    (tmp_path / f"B.HDR{packed}").write_bytes(pack(content[:352]))
    (tmp_path / f"b.img{packed}").write_bytes(pack(content[352:]))
    (tmp_path / f"b.hdr{packed}").write_bytes(pack(content[:352]))
    loaded = load_volume(tmp_path / f"b.img{packed}")
    assert np.array_equal(loaded.values, head().values)


def test_what_is_none_is_refused(tmp_path: Path) -> None:
    for name, content in (("a.nii", b"no header"), ("a.nii.gz", b"\x1f\x8bbroken")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ValueError, match=name):
            load_volume(tmp_path / name)


def resaved(file: Path, affine: np.ndarray, **codes: int) -> Volume:
    """Save the head by nibabel with an affine of its own, RAS."""
    import nibabel

    values = np.asarray(head().values).T
    image = nibabel.Nifti1Image(values, affine)
    image.header["sform_code"] = codes.get("sform", 1)
    image.header["qform_code"] = codes.get("qform", 0)
    if "pixdim" in codes:
        image.header["pixdim"][1:4] = codes["pixdim"]
    image.to_filename(file)
    return head()


def ras(frame: np.ndarray) -> np.ndarray:
    turned: np.ndarray = np.diag([-1.0, -1.0, 1.0, 1.0]) @ frame
    return turned


@pytest.mark.parametrize("factor", [0.3, 0.5, 0.9, 2.0])
def test_the_sform_says_how_large_a_head_is(tmp_path: Path, factor: float) -> None:
    """Also where another field says otherwise and there is no qform."""
    frame = head().world_from_voxel.copy()
    frame[:3, :3] *= factor
    file = tmp_path / "a.nii"
    resaved(file, ras(frame), pixdim=1)
    content = bytearray(file.read_bytes())
    struct.pack_into("<3f", content, 80, *head().spacing_mm)
    file.write_bytes(content)
    volume, notes = read_volume(file)
    assert volume.world_from_voxel == pytest.approx(frame, abs=1e-4)
    assert np.array_equal(volume.values, head().values)
    (note,) = notes
    assert "pixdim of a.nii" in note
    assert "the sform is taken" in note


@pytest.mark.parametrize(("unit", "scale"), [(1, 1e3), (2, 1.0), (3, 1e-3)])
def test_units_other_than_millimetres_are_read(
    tmp_path: Path, unit: int, scale: float
) -> None:
    content = write(tmp_path / "a.nii")
    for place, count in ((80, 3), (268, 3), (280, 12)):
        numbers = np.array(struct.unpack_from(f"<{count}f", content, place)) / scale
        struct.pack_into(f"<{count}f", content, place, *numbers)
    content[123] = unit
    (tmp_path / "a.nii").write_bytes(content)
    volume, notes = read_volume(tmp_path / "a.nii")
    assert volume.world_from_voxel == pytest.approx(head().world_from_voxel, abs=1e-3)
    assert len(notes) == (scale != 1.0)


def test_the_second_version_is_read(tmp_path: Path) -> None:
    import nibabel

    values = np.asarray(head().values).T
    image = nibabel.Nifti2Image(values, ras(head().world_from_voxel))
    image.to_filename(tmp_path / "a.nii.gz")
    volume, notes = read_volume(tmp_path / "a.nii.gz")
    assert np.array_equal(volume.values, head().values)
    assert volume.world_from_voxel == pytest.approx(head().world_from_voxel, abs=1e-9)
    assert notes == []


def test_packed_or_not_is_seen_in_the_bytes(tmp_path: Path) -> None:
    """Browsers unpack what they load, and programs pack without saying so."""
    content = write(tmp_path / "a.nii")
    (tmp_path / "b.nii").write_bytes(gzip.compress(content))
    (tmp_path / "c.nii.gz").write_bytes(content)
    for name in ("b.nii", "c.nii.gz"):
        assert np.array_equal(load_volume(tmp_path / name).values, head().values)
