"""Landmarks in 3D Slicer's files: ``.mrk.json``, and the older ``.fcsv``."""

import csv
from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np

from anatomy.files.volumes import write_file
from anatomy.queries.landmarks import Landmark
from anatomy.tissue import Side
from system import UserError
from system.typed_record import decode_json

SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
    "Markups/Resources/Schema/markups-schema-v1.0.3.json#"
)

FCSV_COLUMNS: list[str] = ["id", "x", "y", "z", *("",) * 7, "label", "desc"]
"""Of an older list of points that does not name them."""

PLACED_RADIUS_MM = 1.0
"""Extent of a landmark that a person has placed in another program."""


_LPS_FROM = {
    "LPS": (1.0, 1.0, 1.0),
    "RAS": (-1.0, -1.0, 1.0),
    # as .fcsv says it
    "1": (1.0, 1.0, 1.0),
    "0": (-1.0, -1.0, 1.0),
}

_PLACED = ("defined", "")
"""How Slicer calls a point that lies somewhere."""


class _ControlPoint(msgspec.Struct, kw_only=True):
    """A point; its position is "" or null where nobody has placed it."""

    id: str = ""
    label: str = ""
    position: tuple[float, float, float] | str | None = None
    description: str = ""
    position_status: str = msgspec.field(default="", name="positionStatus")


class _Markup(msgspec.Struct, kw_only=True, rename="camel"):
    type: str = "Fiducial"
    coordinate_system: str = "LPS"
    control_points: list[_ControlPoint] = []  # msgspec copies it for each


class _Markups(msgspec.Struct, kw_only=True):
    schema: str = msgspec.field(default="", name="@schema")
    markups: list[_Markup]


class _Extent(msgspec.Struct, kw_only=True):
    side: str
    radius_mm: float


def write_markups(landmarks: Mapping[str, Landmark], path: Path) -> None:
    """Write landmarks as fiducial points, LPS mm; atomically."""
    points = [
        _ControlPoint(
            id=str(i + 1),
            label=landmark.name,
            position=(
                float(landmark.position_mm[0]),
                float(landmark.position_mm[1]),
                float(landmark.position_mm[2]),
            ),
            description=msgspec.json.encode(
                _Extent(side=landmark.side.name, radius_mm=landmark.radius_mm)
            ).decode(),
        )
        for i, landmark in enumerate(landmarks.values())
    ]
    markup = _Markup(type="Fiducial", coordinate_system="LPS", control_points=points)
    written = _Markups(schema=SCHEMA, markups=[markup])
    write_file(path, msgspec.json.encode(written) + b"\n")


def read_markups(path: Path) -> dict[str, Landmark]:
    """Read landmarks by `Landmark.key`.

    Points that were added in another program carry no side: they count as being in
    the middle, one millimetre large. Points that nobody has placed are none. Raise
    UserError naming the file that cannot be used.
    """
    try:
        record = path.read_bytes()
    except FileNotFoundError as error:
        raise UserError(f"there is no file {path}") from error
    if path.suffix.lower() == ".fcsv":
        markups = [_listed(path, record)]
    else:
        markups = decode_json(record, _Markups, path, "a markups file").markups
    found: dict[str, Landmark] = {}
    for markup in markups:
        if markup.coordinate_system not in _LPS_FROM:
            raise UserError(
                f"{path} must be in LPS or RAS, got {markup.coordinate_system}"
            )
        signs = _LPS_FROM[markup.coordinate_system]
        for n, point in enumerate(markup.control_points, start=1):
            is_placed = point.position_status in _PLACED
            if not (is_placed and isinstance(point.position, tuple)):
                continue
            side, radius_mm = _extent(point.description)
            place = np.multiply(signs, point.position)
            name = point.label or point.id or f"point {n}"
            landmark = Landmark(name, side, place, radius_mm)
            if not np.isfinite(landmark.position_mm).all():
                raise UserError(f"{path} places {name!r} nowhere")
            found[landmark.key] = landmark
    return found


def _listed(path: Path, record: bytes) -> _Markup:
    """Read a ``.fcsv``: remarks, then a point a line.

    RAS unless a remark says otherwise.
    """
    system, columns, points = "RAS", FCSV_COLUMNS, []
    try:
        lines = record.decode().splitlines()
        for row in csv.reader(lines):
            line = ",".join(row)
            if line.startswith("#"):
                key, _, value = line[1:].partition("=")
                if key.strip() == "CoordinateSystem":
                    system = value.strip()
                elif key.strip() == "columns":
                    columns = [name.strip() for name in value.split(",")]
                continue
            told = dict(zip(columns, row, strict=False))
            if told:
                points.append(
                    _ControlPoint(
                        id=told.get("id", ""),
                        label=told.get("label", ""),
                        position=(
                            float(told["x"]),
                            float(told["y"]),
                            float(told["z"]),
                        ),
                        description=told.get("desc", ""),
                    )
                )
    except (UnicodeDecodeError, ValueError, KeyError, csv.Error) as error:
        raise UserError(
            f"{path} cannot be read as a list of points: {error}"
        ) from error
    return _Markup(coordinate_system=system, control_points=points)


def _extent(description: str) -> tuple[Side, float]:
    try:
        extent = msgspec.json.decode(description, type=_Extent)
        return Side[extent.side], extent.radius_mm
    except (msgspec.DecodeError, UnicodeError, RecursionError, KeyError):
        return Side.MIDLINE, PLACED_RADIUS_MM
