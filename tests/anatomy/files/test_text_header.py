"""Volumes with headers of text as other programs write them."""

import bz2
import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anatomy.files.volumes import load_volume, read_volume

VALUES = np.arange(-500, 500, dtype="<i2")

STORED = VALUES.tobytes()

NRRD = {
    "type": "short",
    "dimension": "3",
    "space": "left-posterior-superior",
    "sizes": "10 10 10",
    "space directions": "(0.5,0,0) (0,0.5,0) (0,0,1.25)",
    "space origin": "(-30.5,-20.25,7.5)",
    "endian": "little",
    "encoding": "raw",
}

META = {
    "ObjectType": "Image",
    "NDims": "3",
    "BinaryData": "True",
    "BinaryDataByteOrderMSB": "False",
    "TransformMatrix": "1 0 0 0 1 0 0 0 1",
    "Offset": "-30.5 -20.25 7.5",
    "ElementSpacing": "0.5 0.5 1.25",
    "DimSize": "10 10 10",
    "ElementType": "MET_SHORT",
    "ElementDataFile": "LOCAL",
}


def write(file: Path, values: Any = STORED, **fields: Any) -> None:
    """Write a volume with fields of its own; detached where the header names a file."""
    named = {name.replace("_", " "): value for name, value in fields.items()}
    if file.suffix in (".mha", ".mhd"):
        known = {"DistanceUnits": "mm"} | META | named
        text = "".join(f"{k} = {v}\n" for k, v in known.items())
        is_alone = known["ElementDataFile"] == "LOCAL"
    else:
        known = NRRD | named
        text = "NRRD0005\n" + "".join(f"{k}: {v}\n" for k, v in known.items()) + "\n"
        is_alone = "data file" not in known
    file.write_bytes(text.encode() + values * is_alone)


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
    write(tmp_path / "a.nrrd", packed, encoding=name)
    assert check(tmp_path / "a.nrrd") == []
    (tmp_path / "b.raw.bz2").write_bytes(packed)
    write(tmp_path / "b.nhdr", encoding=name, data_file="b.raw.bz2")
    assert check(tmp_path / "b.nhdr") == []
    write(tmp_path / "c.nrrd", packed[:-20], encoding=name)
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
    write(tmp_path / "a.nrrd", **fields)
    assert check(tmp_path / "a.nrrd") == []
    packed = gzip.compress(VALUES.tobytes())
    (tmp_path / "b.raw.gz").write_bytes(packed)
    write(tmp_path / "b.nhdr", encoding="gzip", data_file="b.raw.gz", **fields)
    assert check(tmp_path / "b.nhdr") == []


def test_commas_of_two_meanings_are_named(tmp_path: Path) -> None:
    """Half a millimetre along x, or five along y?"""
    axes = "(0,5,0,0) (0,0,5,0) (0,0,1,25)"
    write(tmp_path / "a.nrrd", **{"space directions": axes})
    with pytest.raises(ValueError, match=r"a\.nrrd .*decimal commas, 0,5,0,0.*points"):
        load_volume(tmp_path / "a.nrrd")


@pytest.mark.parametrize("name", ["a.mha", "a.mhd"])
def test_decimal_commas_of_meta_image_are_points(tmp_path: Path, name: str) -> None:
    data = "LOCAL" if name == "a.mha" else "a.raw"
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    write(
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
    write(
        tmp_path / "a.nrrd",
        **{
            "space directions": f"({x},0,0) (0,{y},0) (0,0,{z})",
            "space origin": f"({','.join(origin)})",
            "space units": f'"{unit}" "{unit}" "{unit}"',
        },
    )
    write(
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
    write(tmp_path / "a.nrrd", space_units='"s" "mm" "mm"')
    with pytest.raises(ValueError, match=r"a\.nrrd gives its lengths in 's'"):
        load_volume(tmp_path / "a.nrrd")
