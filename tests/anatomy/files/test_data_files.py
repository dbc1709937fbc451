"""Headers that name files: their neighbours, and what they may not read."""

import os
from pathlib import Path

import numpy as np
import pytest

from anatomy.files.volumes import load_volume, save_volume
from renderers.scene import Volume

VALUES = np.arange(1000, dtype="<i2")

NRRD = (
    "NRRD0005\ntype: short\ndimension: 3\nspace: left-posterior-superior\n"
    "sizes: 10 10 10\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
    "space origin: (0,0,0)\nendian: little\nencoding: raw\ndata file: {}\n"
)
META = (
    "ObjectType = Image\nNDims = 3\nBinaryData = True\n"
    "BinaryDataByteOrderMSB = False\nDimSize = 10 10 10\nElementSpacing = 1 1 1\n"
    "ElementType = MET_SHORT\nElementDataFile = {}\n"
)
HEADERS = {"scan.nhdr": NRRD, "scan.nrrd": NRRD, "scan.mhd": META, "scan.mha": META}


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
    if name == "LIST" and HEADERS[header] is NRRD:
        named = "LIST 2\n" + LIST
    file = folder / header
    file.write_text(HEADERS[header].format(named))
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
    file.write_text(HEADERS[header].format(name.format(up=folder.parent)))
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
    file.write_text(META.format("LOCAL").replace("NDims = 3", line))
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
