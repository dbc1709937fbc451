"""Volumes with headers of text as other programs write them."""

import bz2
import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from anatomy.files.volumes import load_volume, read_volume, save_volume
from renderers.scene import Volume
from tests.anatomy.volume_files import VALUES, write_volume


def check(file: Path) -> list[str]:
    """Return the notes of a volume that must be the one that is meant."""
    volume, notes = read_volume(file)
    assert np.array_equal(volume.values.ravel(), VALUES)
    assert volume.spacing_mm == pytest.approx([0.5, 0.5, 1.25])
    assert volume.origin_mm == pytest.approx([-30.5, -20.25, 7.5])
    return notes


@pytest.mark.parametrize("name", ["bzip2", "bz2", "BZIP2"])
def test_bzip2_is_unpacked(tmp_path: Path, name: str) -> None:
    packed = bz2.compress(VALUES.tobytes())
    write_volume(tmp_path / "a.nrrd", packed, encoding=name)
    assert check(tmp_path / "a.nrrd") == []
    (tmp_path / "b.raw.bz2").write_bytes(packed)
    write_volume(tmp_path / "b.nhdr", encoding=name, data_file="b.raw.bz2")
    assert check(tmp_path / "b.nhdr") == []
    write_volume(tmp_path / "c.nrrd", packed[:-20], encoding=name)
    with pytest.raises(ValueError, match=r"c\.nrrd is cut off or damaged"):
        load_volume(tmp_path / "c.nrrd")


@pytest.mark.parametrize(
    "fields",
    [
        {
            "space directions": "(0,5,0,0,0,0) (0,0,0,5,0,0) (0,0,0,0,1,25)",
            "space origin": "(-30,5,-20,25,7,5)",
        },
        {
            "space directions": "(0,5;0;0) (0;0,5;0) (0;0;1,25)",
            "space origin": "(-30,5;-20,25;7,5)",
        },
    ],
)
def test_decimal_commas_of_nrrd_are_points(
    tmp_path: Path, fields: dict[str, str]
) -> None:
    write_volume(tmp_path / "a.nrrd", **fields)
    assert check(tmp_path / "a.nrrd") == []
    packed = gzip.compress(VALUES.tobytes())
    (tmp_path / "b.raw.gz").write_bytes(packed)
    write_volume(tmp_path / "b.nhdr", encoding="gzip", data_file="b.raw.gz", **fields)
    assert check(tmp_path / "b.nhdr") == []


def test_commas_of_two_meanings_are_named(tmp_path: Path) -> None:
    """Half a millimetre along x, or five along y?"""
    axes = "(0,5,0,0) (0,0,5,0) (0,0,1,25)"
    write_volume(tmp_path / "a.nrrd", **{"space directions": axes})
    with pytest.raises(ValueError, match=r"a\.nrrd .*decimal commas, 0,5,0,0.*points"):
        load_volume(tmp_path / "a.nrrd")


@pytest.mark.parametrize("name", ["a.mha", "a.mhd"])
def test_decimal_commas_of_meta_image_are_points(tmp_path: Path, name: str) -> None:
    data = "LOCAL" if name == "a.mha" else "a.raw"
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    write_volume(
        tmp_path / name,
        ElementSpacing="0,5 0,5 1,25",
        Offset="-30,5 -20,25 7,5",
        ElementDataFile=data,
    )
    assert check(tmp_path / name) == []


@pytest.mark.parametrize(
    ("unit", "scale"), [("um", 1e3), ("µm", 1e3), ("m", 1e-3), ("cm", 0.1), ("mm", 1.0)]
)
def test_units_are_read_and_told(tmp_path: Path, unit: str, scale: float) -> None:
    spacing = [f"{v * scale:.9g}" for v in (0.5, 0.5, 1.25)]
    origin = [f"{v * scale:.9g}" for v in (-30.5, -20.25, 7.5)]
    x, y, z = spacing
    write_volume(
        tmp_path / "a.nrrd",
        **{
            "space directions": f"({x},0,0) (0,{y},0) (0,0,{z})",
            "space origin": f"({','.join(origin)})",
            "space units": f'"{unit}" "{unit}" "{unit}"',
        },
    )
    write_volume(
        tmp_path / "b.mha",
        ElementSpacing=" ".join(spacing),
        Offset=" ".join(origin),
        DistanceUnits=unit,
        ElementDataFile="LOCAL",
    )
    for name in ("a.nrrd", "b.mha"):
        notes = check(tmp_path / name)
        assert len(notes) == (unit != "mm")
        assert all(unit in note for note in notes)


def test_a_unit_that_is_no_length_is_refused(tmp_path: Path) -> None:
    write_volume(tmp_path / "a.nrrd", space_units='"s" "mm" "mm"')
    with pytest.raises(ValueError, match=r"a\.nrrd gives its lengths in 's'"):
        load_volume(tmp_path / "a.nrrd")


HEADERS = "scan.nhdr", "scan.nrrd", "scan.mhd", "scan.mha"


def name_values(file: Path, named: str) -> None:
    """Write a header that says where its values are."""
    field = "data_file" if file.name in HEADERS[:2] else "ElementDataFile"
    write_volume(file, **{field: named})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give a folder of values, with values beside it that are nobody's business."""
    inside = tmp_path / "scan"
    (inside / "sub").mkdir(parents=True)
    for place in (
        tmp_path / "secret.raw",
        inside / "a b.raw",
        inside / "sub" / "a.raw",
    ):
        place.write_bytes(VALUES.tobytes())
    for n in range(10):
        part = VALUES[100 * n : 100 * (n + 1)]
        (inside / f"s{n:02d}.raw").write_bytes(part.tobytes())
    return inside


LIST = "\n".join(f"s{n:02d}.raw" for n in range(10))


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize("name", ["a b.raw", "sub/a.raw", "s%02d.raw 0 9 1", "LIST"])
def test_neighbours_are_read(folder: Path, header: str, name: str) -> None:
    named = name + ("\n" + LIST if name == "LIST" else "")
    if name == "LIST" and header in HEADERS[:2]:
        named = "LIST 2\n" + LIST
    file = folder / header
    name_values(file, named)
    assert np.array_equal(load_volume(file).values.ravel(), VALUES)


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("{up}/secret.raw", "outside its own folder"),
        ("../secret.raw", "outside its own folder"),
        ("sub/../../secret.raw", "outside its own folder"),
        ("link.raw", "outside its own folder"),
        ("/dev/zero", "outside its own folder"),
        ("../s%02d.raw 0 9 1", "outside its own folder"),
        ("LIST\n../secret.raw", "outside its own folder"),
        ("pipe", "no plain file"),
        ("sub", "no plain file"),
        ("absent.raw", "not there"),
        ("a" * 300, "not there"),
        ("LIST\n" + "a" * 5000, "not there"),
        ("LIST\n" + "a/" * 5000, "not there"),
        # as wide a number would fill the memory
        ("s%099999999999d.raw 0 9 1", "not there"),
    ],
)
def test_what_lies_elsewhere_is_not_read(
    folder: Path, header: str, name: str, complaint: str
) -> None:
    os.mkfifo(folder / "pipe")
    (folder / "link.raw").symlink_to("../secret.raw")
    file = folder / header
    name_values(file, name.format(up=folder.parent))
    with pytest.raises(ValueError, match=rf"{header} takes its values .*{complaint}"):
        load_volume(file)


def test_the_partner_of_a_pair_is_a_plain_file(folder: Path) -> None:
    (folder / "scan.hdr").write_bytes(bytes(348))
    os.mkfifo(folder / "scan.img")
    with pytest.raises(ValueError, match=r"scan\.hdr takes its values from scan\.img"):
        load_volume(folder / "scan.hdr")


def test_a_header_without_an_end_is_refused(folder: Path) -> None:
    (folder / "scan.nhdr").write_bytes(b"NRRD0005\n" + b"# more\n" * 200_000)
    with pytest.raises(ValueError, match="header without an end"):
        load_volume(folder / "scan.nhdr")


@pytest.mark.parametrize(
    "line", ["NDims = -3", "  NDims:-1", "NDims = 3\nNDims=-3", f"NDims ={'4' * 23} 3"]
)
def test_dimensions_that_cannot_be_are_refused(folder: Path, line: str) -> None:
    """ITK's reader of MetaImage never comes back from a negative or huge number."""
    file = folder / "scan.mha"
    write_volume(file)
    file.write_bytes(file.read_bytes().replace(b"NDims = 3", line.encode()))
    with pytest.raises(ValueError, match=r"scan\.mha does not say how many"):
        load_volume(file)


@pytest.mark.parametrize("name", ["a.mhd", "a.nhdr", "a.hdr", "a.img"])
def test_a_volume_of_two_files_is_not_saved_by_half(tmp_path: Path, name: str) -> None:
    volume = Volume(VALUES.reshape(10, 10, 10), np.ones(3), np.zeros(3))
    with pytest.raises(ValueError, match=rf"{name} would be two files"):
        save_volume(volume, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_other_formats_are_not_tried(folder: Path) -> None:
    """A format that nobody asked for is one more parser for foreign bytes."""
    (folder / "scan.vtk").write_text(
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\n"
        "DIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 8\n"
        "SCALARS s short 1\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 8\n"
    )
    with pytest.raises(ValueError, match="NRRD, NIfTI and MetaImage files can"):
        load_volume(folder / "scan.vtk")
