"""What a snapshot request may say, and what its result says.

Strict: an unknown key, a number that is not finite or out of range, or a wrong type is
refused with the field's name. A request names data by digest only, never by path.
"""

import math
import re
from typing import Annotated, Literal, Self, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta, Struct

from renderers.art.quality import ClassificationName, Quality
from renderers.scene import (
    Camera,
    Distortion,
    Projection,
)
from renderers.scene.deflection import (
    Cut,
    Deflection,
    Deflector,
    Rotation,
    Scaling,
    Translation,
)
from renderers.scene.lens_state import NONE, LensState, all_over
from system import UserError
from system.validation_message import decode_untyped, validation_message

LARGEST_REQUEST = 256 * 1024
"""Bytes of a request, at most; arrays travel beside it."""

REQUEST_SCHEMA: Literal["paravol.snapshot.request/2"] = "paravol.snapshot.request/2"
RESULT_SCHEMA: Literal["paravol.snapshot.result/2"] = "paravol.snapshot.result/2"

# Patterns are searched, not matched, and `$` accepts a final newline: hence the length.
Digest: TypeAlias = Annotated[
    str, Meta(pattern="^[0-9a-f]{64}$", min_length=64, max_length=64)
]
JobId: TypeAlias = Annotated[
    str, Meta(pattern="^[0-9a-f]{32}$", min_length=32, max_length=32)
]


def is_job_id(name: str) -> bool:
    """Return whether a name from a folder may be a job's."""
    return re.fullmatch(r"[0-9a-f]{32}", name) is not None


Coordinate: TypeAlias = Annotated[float, Meta(ge=-1e7, le=1e7)]
Cosine: TypeAlias = Annotated[float, Meta(ge=-1.001, le=1.001)]
Positive: TypeAlias = Annotated[float, Meta(gt=0, le=1e6)]
Share: TypeAlias = Annotated[float, Meta(ge=0, le=1)]
Amount: TypeAlias = Annotated[float, Meta(ge=0, le=1e6)]
Pixels: TypeAlias = Annotated[int, Meta(ge=8, le=8192)]
Point: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Axis: TypeAlias = tuple[Cosine, Cosine, Cosine]
Row: TypeAlias = tuple[Cosine, Cosine, Cosine, Coordinate]
QualityName = Literal["preview", "snapshot", "final", "reference"]
ProjectionName = Literal["equidistant", "perspective", "orthographic"]
MaterialName = Literal["METAL", "DARK_PLASTIC", "BLOOD", "MUCUS", "POLYP", "BONE"]
Samples = Literal[1, 4]


class _Strict(Struct, forbid_unknown_fields=True, frozen=True):
    pass


class GridSpec(_Strict, frozen=True):
    """Place an array in the patient's frame; see `renderers.scene.Volume`."""

    spacing_mm: tuple[Positive, Positive, Positive]
    origin_mm: Point
    direction: tuple[Axis, Axis, Axis]
    """Rows of the 3 x 3 matrix."""


class CameraSpec(_Strict, frozen=True):
    """Place an eye and its lens; see `renderers.scene.Camera`.

    distortion: k1 and k2 of the lens.
    """

    eye_mm: Point
    axes: tuple[Axis, Axis, Axis]
    """Unit right, up and forward."""
    extent: Positive
    projection: ProjectionName = "equidistant"
    distortion: tuple[float, float] = (0.0, 0.0)


class ImageSpec(_Strict, frozen=True):
    """Size a picture. samples: per pixel; 4 are 2 x 2."""

    width: Pixels
    height: Pixels
    samples: Samples = 1


class InstrumentSpec(_Strict, frozen=True):
    """Place a mesh. vertices: ``(n, 3)`` float64 mm. faces: ``(m, 3)`` int32.

    capsules: ``(k, 7)`` float64, see `renderers.scene.Mesh`.
    """

    vertices: Digest
    faces: Digest
    material: MaterialName
    world_from_mesh: tuple[Row, Row, Row]
    capsules: Digest | None = None


class PathTracingSpec(_Strict, frozen=True):
    """Follow light from wall to wall by random paths; see `renderers.shading.paths`.

    paths: of each ray, on average, at most. noise: enough when the error estimated is
    this share of the light. state: what an earlier job of the same view left, to go on
    from: float64 ``(h, w, 7)`` of its rays.
    """

    paths: Annotated[int, Meta(ge=32, le=2**20)] = 256
    noise: Share = 0.0
    state: Digest | None = None


class WoundsSpec(_Strict, frozen=True):
    """Name what tells a cut surface from a healthy one; see `renderers.scene.Wounds`.

    flesh, bone, deep: uint8 arrays of the head's grid. film: bricks of uint8 that are
    wet, as `ScopeWork.changes` has them; None for a dry head. pale: likewise bricks of
    uint8 where mucosa was injected. The pristine distance is
    the work's own, but for bent: bricks of float32 of it where tissue gave way to a
    tool; None where none did. rest: bricks of float32 of the offsets, mm along x, y and
    z, from there to where that tissue lies at rest; see `renderers.scene.RestOffsets`.
    """

    flesh: Digest
    bone: Digest
    deep: Digest
    film: Digest | None = None
    bent: Digest | None = None
    rest: tuple[Digest | None, Digest | None, Digest | None] | None = None
    pale: Digest | None = None


ShareOfSector = tuple[Share, Share, Share, Share, Share, Share, Share, Share]


class OnLens(_Strict, frozen=True, kw_only=True):
    """What lies on the front lens, see `renderers.scene.lens_state`.

    soil: blood all over it, as in files from before it lay in sectors.
    """

    soil: Share = 0.0
    fog: Share = 0.0
    soil_seed: Annotated[int, Meta(ge=0, lt=2**31)] = 0
    soil_blood: ShareOfSector = NONE
    soil_mucus: ShareOfSector = NONE
    drops: Share = 0.0

    @property
    def lens(self) -> LensState:
        """Return what lies on the front lens."""
        blood = all_over(self.soil) if self.soil else self.soil_blood
        return LensState(blood, self.soil_mucus, self.fog, self.drops, self.soil_seed)

    def through(self, lens: LensState) -> Self:
        """Return the same with something else on the lens."""
        return msgspec.structs.replace(
            self,
            soil=0.0,
            soil_blood=lens.blood,
            soil_mucus=lens.mucus,
            fog=lens.fog,
            drops=lens.drops,
            soil_seed=lens.seed,
        )


class ScopeWork(OnLens, frozen=True, tag="scope", tag_field="mode"):
    """Draw what the endoscope sees.

    distance, blood, skin: arrays of one grid; see `renderers.scene.AirSurface`.
    gain: of the camera, frozen; None meters the picture. changes: of a head that was
    operated on, whose distance is the one before: an array int32 ``(n, 513)`` of the
    bricks of 8 x 8 x 8 voxels that differ, ascending. A row is a brick's number, x
    fastest, and the bits of its values; see `renderers.snapshots.volume_changes`. None
    where none differ. wounds: None for a head that nobody operates on.
    """

    distance: Digest
    blood: Digest
    skin: Digest
    grid: GridSpec
    ring_radius_mm: Annotated[float, Meta(gt=0, le=20)] = 1.45
    light_power: Amount = 1.0
    seed: Annotated[int, Meta(ge=0, lt=2**31)] = 7
    blood_bias: Annotated[float, Meta(ge=0, le=10)] = 1.0
    gain: Annotated[float, Meta(gt=0, le=1e9)] | None = None
    frame_number: Annotated[int, Meta(ge=0, lt=2**31)] = 0
    instruments: Annotated[tuple[InstrumentSpec, ...], Meta(max_length=16)] = ()
    path_tracing: PathTracingSpec | None = msgspec.field(name="truth", default=None)
    changes: Digest | None = None
    wounds: WoundsSpec | None = None


class LightSpec(_Strict, frozen=True):
    """Place a light; see `renderers.scene.Light`."""

    vector: Point
    color: tuple[Amount, Amount, Amount]
    is_local: bool = False


class NodeSpec(_Strict, frozen=True):
    """Set one node of a transfer function."""

    density: Coordinate
    color: tuple[Amount, Amount, Amount]
    kappa_per_mm: Amount


class ClassicWork(_Strict, frozen=True, tag="classic", tag_field="mode"):
    """Draw a volume through a transfer function, and opaque instruments within it.

    changes: as in `ScopeWork`, bricks of the volume's own type: a row has 1 + 128 x
    (bytes of a value) numbers.
    """

    volume: Digest
    grid: GridSpec
    nodes: Annotated[tuple[NodeSpec, ...], Meta(min_length=2, max_length=512)]
    lights: Annotated[tuple[LightSpec, ...], Meta(max_length=16)] = ()
    ambient: Share = 0.25
    diffuse: Amount = 0.9
    specular: Amount = 0.0
    shininess: Annotated[float, Meta(ge=1, le=1000)] = 16.0
    background: tuple[Share, Share, Share] = (0.0, 0.0, 0.0)
    instruments: Annotated[tuple[InstrumentSpec, ...], Meta(max_length=16)] = ()
    changes: Digest | None = None


Millimetres: TypeAlias = Annotated[float, Meta(gt=0, le=1e4)]


class _Ball(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind"):
    center_mm: Point
    radius_mm: Millimetres


class TranslationSpec(_Ball, frozen=True, tag="translate"):
    """Pull tissue; see `renderers.scene.deflection.Translation`."""

    shift_mm: Point


class RotationSpec(_Ball, frozen=True, tag="rotate"):
    """Turn tissue; see `renderers.scene.deflection.Rotation`."""

    axis: Point
    angle_deg: Annotated[float, Meta(ge=-720, le=720)]


class ScalingSpec(_Ball, frozen=True, tag="scale"):
    """Swell or shrink tissue; see `renderers.scene.deflection.Scaling`."""

    factor: Annotated[float, Meta(gt=0, le=1000)]


class CutSpec(_Ball, frozen=True, tag="cut"):
    """Part tissue; see `renderers.scene.deflection.Cut`."""

    normal: Point
    pull_mm: Millimetres


DeflectorSpec: TypeAlias = TranslationSpec | RotationSpec | ScalingSpec | CutSpec


class SnapshotRequest(_Strict, frozen=True):
    """Request one picture.

    priority: 0 is drawn first. step_voxels, cutoff: replace those of `quality`; a step
    given is taken in any scene.
    max_seconds: from its first rays on; the best picture so far is delivered then.
    deadline_s: it fails when it is
    not done so long after it was asked for; None for whenever. progressive: coarse
    pictures are traced first, so that a picture can be had at any moment, and those
    and parts of the picture itself are shown as they come. deflectors: bend the
    rays, the first of them moving the undeformed tissue. deliver_after_s: the best
    picture so far is delivered then. tolerance: 4 samples a pixel only where they
    matter most, until the error is estimated at so many codes; 0 for everywhere, in
    that order; None in whatever order is quickest. In mode scope without path tracing.
    classification: see `Quality`.
    """

    schema: Literal["paravol.snapshot.request/2"]
    id: JobId
    camera: CameraSpec
    image: ImageSpec
    work: ScopeWork | ClassicWork
    quality: QualityName = "snapshot"
    step_voxels: Annotated[float, Meta(ge=1 / 256, le=4)] | None = None
    cutoff: Annotated[float, Meta(ge=0, lt=0.5)] | None = None
    priority: Annotated[int, Meta(ge=0, le=9)] = 5
    client: Annotated[str, Meta(max_length=200)] = ""
    max_seconds: Annotated[float, Meta(gt=0, le=86_400)] = 600.0
    deadline_s: Annotated[float, Meta(gt=0, le=2_592_000)] | None = None
    progressive: bool = False
    deflectors: Annotated[tuple[DeflectorSpec, ...], Meta(max_length=16)] = ()
    deliver_after_s: Annotated[float, Meta(gt=0, le=86_400)] | None = None
    classification: ClassificationName = "integrated"
    tolerance: Annotated[float, Meta(ge=0, le=255)] | None = None

    def to_camera(self) -> Camera:
        """Build the camera of one sample a pixel."""
        camera = self.camera
        return Camera(
            np.array([camera.eye_mm, *camera.axes]),
            camera.extent,
            self.image.width,
            self.image.height,
            Projection[camera.projection.upper()],
            Distortion(*camera.distortion),
        )

    def through(self, lens: LensState) -> "SnapshotRequest":
        """Return the same as it is seen through a lens on which something lies."""
        if lens.is_clean or not isinstance(self.work, ScopeWork):
            return self
        return msgspec.structs.replace(self, work=self.work.through(lens))

    def to_quality(self) -> Quality:
        """Build the quality with its replacements."""
        named = Quality.named(self.quality)
        step, cutoff = self.step_voxels, self.cutoff
        return Quality(
            named.step_voxels if step is None else step,
            named.cutoff if cutoff is None else cutoff,
            named.renormalise,
            named.compact,
            classification=self.classification,
            tolerance=named.tolerance if step is None else None,
        )


class SnapshotResult(_Strict, frozen=True):
    """Report what was drawn, and what it cost.

    seconds: `load`, `trace`, `shade`, `total`. digests: of the files, by name.
    counters: what tracing cost; views_skipped, traces_skipped: 1 where a picture, or
    what its rays found, was there from before.
    complete: False for the best picture there was when it had to be delivered. traced:
    share of the rays that were; the others show what a coarser picture has. noise: of
    light by random paths, root mean square over the mean; None where there is none, or
    it is not known yet. error: estimated root mean square error, in codes of the
    encoded light, of a picture whose samples went where they mattered most, or whose
    rays were not all traced, or whose paths were not walked everywhere; else None.
    camera_in_tissue: see `renderers.snapshots.scene_loader`. step_voxels: of the steps
    taken, which a scene may have made shorter than its quality's; None where nothing,
    or not all, was traced for this picture.
    """

    schema: Literal["paravol.snapshot.result/2"]
    id: JobId
    mode: Literal["scope", "classic"]
    width: int
    height: int
    ranks: int
    attempt: int
    gain: float | None
    complete: bool
    traced: float
    noise: float | None
    error: float | None
    seconds: dict[str, float]
    counters: dict[str, int]
    digests: dict[str, Digest]
    camera_in_tissue: bool = False
    step_voxels: float | None = None


def decode_request(record: bytes) -> SnapshotRequest:
    """Read a request; raise ValueError that names the field which is wrong."""
    if len(record) > LARGEST_REQUEST:
        raise UserError(
            f"a request has at most {LARGEST_REQUEST} bytes, got {len(record)}"
        )
    try:
        request = msgspec.json.decode(record, type=SnapshotRequest)
    except msgspec.ValidationError as error:
        words = validation_message(error, SnapshotRequest, decode_untyped(record))
        raise UserError(words) from error
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise UserError(f"a request is JSON; {error}") from error
    try:
        to_deflection(request.deflectors)
    except ValueError as error:
        raise UserError(f"deflectors: {error}") from error
    try:
        request.to_camera()
    except ValueError as error:
        raise UserError(f"camera: {error}") from error
    if request.camera.projection != "equidistant" and isinstance(
        request.work, ScopeWork
    ):
        raise UserError("camera: mode scope needs an equidistant lens")
    return request


def to_deflection(specs: tuple[DeflectorSpec, ...]) -> Deflection:
    """Build deflectors; FoldError or ValueError where one cannot be."""
    return Deflection(tuple(_built(spec) for spec in specs))


def _built(spec: DeflectorSpec) -> Deflector:
    center, radius = np.array(spec.center_mm), spec.radius_mm
    match spec:
        case TranslationSpec():
            return Translation(center, radius, np.array(spec.shift_mm))
        case RotationSpec():
            angle = math.radians(spec.angle_deg)
            return Rotation(center, radius, np.array(spec.axis), angle)
        case ScalingSpec():
            return Scaling(center, radius, spec.factor)
        case CutSpec():
            return Cut(center, radius, np.array(spec.normal), spec.pull_mm)
