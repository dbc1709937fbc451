"""Landmarks in 3D Slicer's ``.mrk.json`` files."""

from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np

from anatomy.files.volumes import write_file
from anatomy.queries.landmarks import Landmark
from anatomy.tissue import Side
from disk import UserError
from disk.typed_record import decode_json

SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
    "Markups/Resources/Schema/markups-schema-v1.0.3.json#"
)

PLACED_RADIUS_MM = 1.0
"""Extent of a landmark that a person has placed in another program."""


class _ControlPoint(msgspec.Struct, kw_only=True):
    id: str
    label: str
    position: tuple[float, float, float]
    description: str = ""


class _Markup(msgspec.Struct, kw_only=True, rename="camel"):
    type: str
    coordinate_system: str
    control_points: list[_ControlPoint]


class _Markups(msgspec.Struct, kw_only=True):
    schema: str = msgspec.field(name="@schema")
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
    the middle, one millimetre large. Raise ValueError naming the file that cannot be
    used; a frame other than LPS is refused.
    """
    try:
        record = path.read_bytes()
    except FileNotFoundError as error:
        raise UserError(f"there is no file {path}") from error
    content = decode_json(record, _Markups, path, "a markups file")
    found: dict[str, Landmark] = {}
    for markup in content.markups:
        if markup.coordinate_system != "LPS":
            raise UserError(f"{path} must be in LPS, got {markup.coordinate_system}")
        for point in markup.control_points:
            side, radius_mm = _extent(point.description)
            landmark = Landmark(point.label, side, np.array(point.position), radius_mm)
            if not np.isfinite(landmark.position_mm).all():
                raise UserError(f"{path} places {point.label!r} nowhere")
            found[landmark.key] = landmark
    return found


def _extent(description: str) -> tuple[Side, float]:
    try:
        extent = msgspec.json.decode(description, type=_Extent)
        return Side[extent.side], extent.radius_mm
    except (msgspec.DecodeError, UnicodeError, RecursionError, KeyError):
        return Side.MIDLINE, PLACED_RADIUS_MM
