"""A view as a file: which head, from where, through which lens, in which light.

``NAME.view.json``, for people and machines. Strict: an unknown key or a number out of
range is refused by name. What is written is read back to the last bit, so that a
picture taken from a saved view is the one that was seen.
"""

from pathlib import Path
from typing import Annotated, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import ArrayLike

from renderers.scene import Camera, Distortion, Projection
from renderers.snapshots.request import (
    Amount,
    Axis,
    DeflectorSpec,
    OnLens,
    Pixels,
    Point,
    Positive,
    ProjectionName,
    Row,
    to_deflection,
)
from renderers.snapshots.scene_loader import rigid_pose
from scenarios.instruments import instrument_named
from system import UserError, whole_file
from system.typed_record import decode_json

T = TypeVar("T")

LARGEST_VIEW = 256 * 1024
"""Bytes of a view file, at most."""


class _Strict(Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    pass


class PhantomHead(_Strict, frozen=True, tag="phantom", tag_field="kind"):
    """Look at a virtual patient, built when it is needed.

    variants, polyps_right, polyps_left, decongested, disease: see
    `scenarios.scenario.Head`. drawn: it is no average adult.
    """

    seed: Annotated[int, Meta(ge=0, lt=2**31)] = 1
    spacing_mm: Positive = 0.5
    variants: tuple[str, ...] = ()
    polyps_right: Annotated[int, Meta(ge=0, le=4)] = 0
    polyps_left: Annotated[int, Meta(ge=0, le=4)] = 0
    decongested: bool = False
    disease: tuple[str, ...] = ()
    drawn: bool = False


class SceneHead(_Strict, frozen=True, tag="scene", tag_field="kind"):
    """Look at an abstract scene, built when it is needed."""

    name: Annotated[str, Meta(min_length=1)]
    seed: Annotated[int, Meta(ge=0, lt=2**31)] = 1
    spacing_mm: Positive = 0.5


class CaseHead(_Strict, frozen=True, tag="case", tag_field="kind"):
    """Look at a case. folder: a full path, or beside the view file."""

    folder: Annotated[str, Meta(min_length=1)]
    decongested: bool = False


class ScanHead(_Strict, frozen=True, tag="scan", tag_field="kind"):
    """Look at a scan as it is. file: a full path, or beside the view file."""

    file: Annotated[str, Meta(min_length=1)]


Head = PhantomHead | SceneHead | CaseHead | ScanHead


class ViewCamera(_Strict, frozen=True):
    """Place an eye and its lens, in mm, patient LPS.

    Either axes (unit right, up and forward: exact) or a target, with up roughly upwards
    (easy to write). extent: half the field on the picture's shorter side, in radians,
    orthographic in mm. distortion: k1 and k2 of the lens; see
    `renderers.scene.distortion`.
    """

    eye_mm: Point
    extent: Positive
    axes: tuple[Axis, Axis, Axis] | None = None
    target_mm: Point | None = None
    up: Point | None = None
    projection: ProjectionName = "equidistant"
    distortion: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def of(cls, camera: Camera) -> "ViewCamera":
        """Describe a camera, exactly."""
        return cls(
            msgspec.convert(camera.eye_mm.tolist(), Point),
            camera.extent,
            msgspec.convert(camera.frame[1:].tolist(), tuple[Axis, Axis, Axis]),
            projection=msgspec.convert(camera.projection.name.lower(), ProjectionName),
            distortion=(camera.distortion.k1, camera.distortion.k2),
        )

    def camera(
        self, size: tuple[int, int], right_before: ArrayLike | None = None
    ) -> Camera:
        """Build the camera; UserError where the two ways to aim are mixed.

        right_before: as `Camera.looking_at` has it.
        """
        projection = Projection[self.projection.upper()]
        distortion = Distortion(*self.distortion)
        if (self.axes is None) == (self.target_mm is None):
            raise UserError(
                "A view's camera needs either axes or target_mm, one of them alone."
            )
        if self.axes is not None:
            if self.up is not None:
                raise UserError("A view's up goes with target_mm; axes have their own.")
            frame = np.array([self.eye_mm, *self.axes])
            return Camera(frame, self.extent, *size, projection, distortion)
        assert self.target_mm is not None
        return Camera.looking_at(
            self.eye_mm,
            self.target_mm,
            up=self.up or (0.0, 0.0, 1.0),
            extent=self.extent,
            size=size,
            projection=projection,
            distortion=distortion,
            right_before=right_before,
        )


class ScopeLook(OnLens, frozen=True, tag="scope", tag_field="mode"):
    """See it as an endoscope does; the fields are those of `ScopeWork`."""

    ring_radius_mm: Annotated[float, Meta(gt=0, le=20)] = 0.95
    light_power: Amount = 1.0
    seed: Annotated[int, Meta(ge=0, lt=2**31)] = 7
    blood_bias: Annotated[float, Meta(ge=0, le=10)] = 1.0
    gain: Annotated[float, Meta(gt=0, le=1e9)] | None = None
    frame_number: Annotated[int, Meta(ge=0, lt=2**31)] = 0


class ClassicLook(_Strict, frozen=True, tag="classic", tag_field="mode"):
    """See it through the head's transfer function."""


class PlacedInstrument(_Strict, frozen=True):
    """Place one of the catalogue's instruments. jaw: 0 open to 1 closed."""

    name: str
    world_from_instrument: tuple[Row, Row, Row]
    jaw: Annotated[float, Meta(ge=0, le=1)] = 1.0


class OperatedMark(_Strict, frozen=True):
    """That the head was operated on; the cuts themselves are in the recording.

    digest: see `OperatedHead`. recording: folder where the flight was recorded, ""
    where that is not known. time_s: of the flight.
    """

    digest: Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
    recording: str = ""
    time_s: Annotated[float, Meta(ge=0, le=1e9)] = 0.0


class ViewFile(_Strict, frozen=True):
    """Describe one picture but for how finely it is drawn.

    deflectors: pull, turn, swell or cut its tissue; the first moves what was there.
    surface_sha256: of the head's surface before any operation, where the view must not
    be of another. operated: None for a head that was not operated on.
    """

    schema: Literal["paravol.view/1"]
    head: Head
    camera: ViewCamera
    size_px: tuple[Pixels, Pixels] = (512, 512)
    look: ScopeLook | ClassicLook = ScopeLook()
    instruments: Annotated[tuple[PlacedInstrument, ...], Meta(max_length=16)] = ()
    deflectors: Annotated[tuple[DeflectorSpec, ...], Meta(max_length=16)] = ()
    surface_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")] | None = None
    title: Annotated[str, Meta(max_length=200)] = ""
    operated: OperatedMark | None = None

    def to_camera(self) -> Camera:
        """Build the camera."""
        return self.camera.camera(self.size_px)


def save_view(path: Path, view: ViewFile) -> None:
    """Write a view, atomically."""
    text = msgspec.json.format(msgspec.json.encode(view), indent=2)
    with whole_file(path) as beside:
        beside.write_bytes(text + b"\n")


def load_view(path: Path) -> ViewFile:
    """Read a view; UserError says what is wrong with which field of which file.

    Relative places of the head are taken from the file's own folder.
    """
    view = decoded(path, ViewFile, "view")
    try:
        camera = view.to_camera()
        if view.camera.axes is None:
            # once and for all: whatever must be said of its up has been said
            view = msgspec.structs.replace(view, camera=ViewCamera.of(camera))
        to_deflection(view.deflectors)
        for tool in view.instruments:
            rigid_pose(tool.world_from_instrument)
            instrument_named(tool.name)
    except ValueError as error:
        raise UserError(f"The view file {path} is not valid: {error}") from error
    head = view.head
    if isinstance(head, CaseHead):
        head = CaseHead(str(path.parent / head.folder), head.decongested)
    elif isinstance(head, ScanHead):
        head = ScanHead(str(path.parent / head.file))
    return msgspec.structs.replace(view, head=head)


def decoded(path: Path, kind: type[T], word: str) -> T:
    """Read a strict JSON file of at most `LARGEST_VIEW` bytes."""
    try:
        with path.open("rb") as file:
            record = file.read(LARGEST_VIEW + 1)
    except OSError as error:
        raise UserError(
            f"The {word} file {path} cannot be read ({error.strerror})."
        ) from error
    if len(record) > LARGEST_VIEW:
        raise UserError(
            f"The {word} file {path} is larger than {LARGEST_VIEW} bytes; it cannot "
            f"be one."
        )
    return decode_json(record, kind, path, f"a {word} file")


def both_eyes(view: ViewFile, apart_mm: float) -> list[ViewFile]:
    """Return the left and the right eye's view: parallel axes, so far apart."""
    camera = view.to_camera()
    views = []
    for sign in (-0.5, 0.5):
        frame = camera.frame.copy()
        frame[0] += sign * apart_mm * frame[1]
        moved = ViewCamera.of(camera.moved(frame))
        views.append(msgspec.structs.replace(view, camera=moved))
    return views


def exposed(view: ViewFile, gain: float | None) -> ViewFile:
    """Fix the camera's gain, so that two pictures can be compared."""
    if not isinstance(view.look, ScopeLook) or gain is None:
        return view
    look = msgspec.structs.replace(view.look, gain=gain)
    return msgspec.structs.replace(view, look=look)
