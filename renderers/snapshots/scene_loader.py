"""The scene a request names, loaded from the spool's data."""

import math

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderers.scene import (
    AIR_HU,
    AirSurface,
    Light,
    Material,
    Mesh,
    PhongMaterial,
    Projection,
    RestOffsets,
    Scene,
    TransferFunction,
    Volume,
    Wounds,
)
from renderers.scene.deflection import deflected_surface
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.request import (
    ClassicWork,
    GridSpec,
    InstrumentSpec,
    ScopeWork,
    SnapshotRequest,
    WoundsSpec,
    to_deflection,
)
from renderers.snapshots.volume_changes import VolumeChanges, rest_offsets
from system import UserError

LARGEST_VOLUME = 8 << 30
LARGEST_MESH = 256 << 20
"""Bytes of data accepted, so that a slip of the pen cannot fill the memory."""

_VOLUME_TYPES = ("int16", "uint16", "uint8", "float32")


def load_volume(
    data: DataStore, digest: str, grid: GridSpec, *dtypes: str, background: float
) -> Volume:
    """Map a volume; raise ValueError when it is not what the request says."""
    values = data.get(digest, dtypes or _VOLUME_TYPES, LARGEST_VOLUME)
    return Volume(
        values,
        np.array(grid.spacing_mm),
        np.array(grid.origin_mm),
        np.array(grid.direction),
        background,
    )


def edited(data: DataStore, base: Volume, changes: str | None, name: str) -> Volume:
    """Return a volume with the bricks of a digest written into a copy of it.

    The volume itself where there are none. ValueError, beginning with `name`, for
    bricks that do not fit.
    """
    if changes is None:
        return base
    record = data.get(changes, ("int32",), LARGEST_VOLUME)
    bricks = VolumeChanges.of_record(record, base.values, name)
    return base.with_values(bricks.applied(base.values), base.background)


def load_scene(data: DataStore, request: SnapshotRequest) -> Scene:
    """Load what a request needs to be traced and shaded."""
    work = request.work
    if isinstance(work, ClassicWork):
        volume = load_volume(data, work.volume, work.grid, background=AIR_HU)
        return Scene(
            edited(data, volume, work.changes, "changes"),
            TransferFunction(
                np.array([node.density for node in work.nodes]),
                np.array([node.color for node in work.nodes]),
                np.array([node.kappa_per_mm for node in work.nodes]),
            ),
            tuple(
                Light(np.array(light.vector), np.array(light.color), light.is_local)
                for light in work.lights
            ),
            PhongMaterial(work.ambient, work.diffuse, work.specular, work.shininess),
        )
    base = load_volume(data, work.distance, work.grid, "float32", background=1.0)
    distance = edited(data, base, work.changes, "changes")
    blood = load_volume(data, work.blood, work.grid, "uint8", background=0.0)
    skin = load_volume(data, work.skin, work.grid, "uint8", background=0.0)
    # Mode scope classifies nothing; the distance stands in for a density.
    nothing = TransferFunction(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(2))
    wounds = rest = None
    if work.wounds is not None:
        wounds = _wounds(data, base, work.grid, work.wounds)
        rest = _rest(data, base, work.wounds)
    surface = AirSurface(distance, blood, skin, wounds, rest)
    return Scene(distance, nothing, surface=surface)


def _rest(data: DataStore, base: Volume, spec: WoundsSpec) -> RestOffsets | None:
    """Load where pushed tissue lies at rest; ValueError where it does not fit."""
    if spec.rest is None:
        return None
    still = np.broadcast_to(np.zeros((), np.float32), base.shape)
    none = VolumeChanges.between(still[:1], still[:1])
    parts = []
    for axis, digest in zip("xyz", spec.rest, strict=True):
        part = none
        if digest is not None:
            record = data.get(digest, ("int32",), LARGEST_VOLUME)
            part = VolumeChanges.of_record(record, still, f"wounds.rest.{axis}")
        parts.append(part)
    return rest_offsets((parts[0], parts[1], parts[2]), base)


def _wounds(
    data: DataStore, pristine: Volume, grid: GridSpec, spec: WoundsSpec
) -> Wounds:
    """Load what tells a cut from a healthy surface; UserError where it does not fit.

    pristine: the distance before any tissue was taken.
    """
    layers: list[Volume] = []
    for name in ("flesh", "bone", "deep"):
        digest = getattr(spec, name)
        layer = load_volume(data, digest, grid, "uint8", background=0.0)
        if layer.shape != pristine.shape:
            raise UserError(
                f"wounds.{name} must be of shape {pristine.shape}, got {layer.shape}"
            )
        layers.append(layer)
    dry = pristine.with_values(np.zeros(pristine.shape, np.uint8), 0.0)
    flesh, bone, deep = layers
    film = edited(data, dry, spec.film, "wounds.film")
    pale = edited(data, dry, spec.pale, "wounds.pale")
    bent = edited(data, pristine, spec.bent, "wounds.bent")
    return Wounds(bent, flesh, bone, deep, film, pale)


def scene_key(request: SnapshotRequest) -> bytes:
    """Describe what a prepared ray tracer depends on; equal keys may share one."""
    work = request.work
    if isinstance(work, ScopeWork):
        part: object = (
            work.distance,
            work.changes,
            work.blood,
            work.skin,
            work.grid,
        )
    else:
        part = msgspec.structs.replace(work, instruments=())
    return _key(part, request)


def family_key(request: SnapshotRequest) -> bytes:
    """Describe a request but for its volumes' values.

    Where this is equal and `scene_key` is not, the volume was edited.
    """
    work = request.work
    part: object = ("scope", work.grid)
    if isinstance(work, ClassicWork):
        part = msgspec.structs.replace(work, volume="", changes=None, instruments=())
    return _key(part, request)


def _key(part: object, request: SnapshotRequest) -> bytes:
    fineness = request.quality, request.step_voxels, request.cutoff
    how = *fineness, request.classification, request.deflectors
    return msgspec.json.encode((part, *how))


def seen_surface(request: SnapshotRequest, scene: Scene) -> AirSurface:
    """Return the surface whose light is found: deformed as the rays see it."""
    if scene.surface is None:
        raise UserError("the scene has no air surface; mode scope needs one")
    if not request.deflectors:
        return scene.surface
    return deflected_surface(scene.surface, to_deflection(request.deflectors))


def rigid_pose(rows: ArrayLike) -> NDArray[np.float64]:
    """Return the 4x4 transform of three rows; UserError where it would bend a tool."""
    pose = np.eye(4)
    pose[:3] = rows
    rotation = pose[:3, :3]
    if not np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-5) or (
        math.copysign(1, np.linalg.det(rotation)) < 0
    ):
        raise UserError(
            f"an instrument's pose must be rigid, a turn and a shift, got "
            f"{pose[:3].tolist()}"
        )
    return pose


def load_tools(data: DataStore, request: SnapshotRequest) -> list[PlacedMesh]:
    """Load the instruments that a request's rays end at: those of mode classic.

    In mode scope instruments are put before or behind what rays found.
    """
    work = request.work
    if isinstance(work, ScopeWork):
        return []
    return instrument_meshes(data, work.instruments)


def instrument_meshes(
    data: DataStore, instruments: tuple[InstrumentSpec, ...]
) -> list[PlacedMesh]:
    """Load a request's instruments with their world-from-mesh transforms."""
    result = []
    for spec in instruments:
        pose = rigid_pose(spec.world_from_mesh)
        capsules = None
        if spec.capsules is not None:
            stored = data.get(spec.capsules, ("float64",), LARGEST_MESH)
            capsules = np.asarray(stored)
        mesh = Mesh(
            np.asarray(data.get(spec.vertices, ("float64",), LARGEST_MESH)),
            np.asarray(data.get(spec.faces, ("int32",), LARGEST_MESH)),
            Material[spec.material],
            capsules,
        )
        result.append((mesh, pose))
    return result


ROUNDING = 1e-9
"""Of the way to the volume's middle."""


def camera_in_tissue(request: SnapshotRequest, scene: Scene) -> bool:
    """Return whether the eye is in what it looks at.

    In mode scope: behind the surface of the air. In mode classic: where the transfer
    function lets less than all light through. Deflected tissue counts where it is
    seen. An orthographic view has no eye, and whoever stands beside the volume is not
    in it.
    """
    camera = request.to_camera()
    if camera.projection is Projection.ORTHOGRAPHIC:
        return False
    eye = camera.eye_mm
    if request.deflectors:
        eye = to_deflection(request.deflectors).pull_back(eye[None])[0]
    if isinstance(request.work, ScopeWork):
        if scene.surface is None:
            return False
        field = scene.surface.distance
    else:
        field = scene.volume
    # on a face one is in it, however its place is rounded
    eye = eye + ROUNDING * (field.center_mm - eye)
    voxel = field.voxel_from_world[:3, :3] @ eye + field.voxel_from_world[:3, 3]
    if np.any(voxel < 0) or np.any(voxel > np.array(field.shape[::-1]) - 1):
        return False
    value = field.sample(eye)
    if isinstance(request.work, ScopeWork):
        return bool(value > 0)
    _, kappa = scene.transfer_function.evaluate(value)
    return bool(np.max(kappa) > 0)
