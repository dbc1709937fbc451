"""Volumes with headers of text written for tests, as other programs write them."""

from pathlib import Path
from typing import Any

import numpy as np

VALUES = np.arange(-500, 500, dtype="<i2")
"""Of a volume of 10 x 10 x 10."""

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
    "DistanceUnits": "mm",
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


def write_volume(
    file: Path, values: Any = STORED, more: str = "", **fields: Any
) -> None:
    """Write a volume with fields of its own, "" for none; MetaImage by its name.

    more: lines behind the fields. Values are left out where the header names a file.
    """
    named = {name.replace("_", " "): value for name, value in fields.items()}
    if file.suffix in (".mha", ".mhd"):
        known = META | named
        text = "".join(f"{k} = {v}\n" for k, v in known.items() if v)
        is_alone = known["ElementDataFile"] == "LOCAL"
    else:
        known = NRRD | named
        lines = [f"{k}: {v}\n" for k, v in known.items() if v]
        is_alone = "data file" not in known
        text = f"NRRD0005\n{''.join(lines)}{more}" + "\n" * is_alone
    file.write_bytes(text.encode() + values * is_alone)
