"""How a program asks for snapshots and gets them."""

import time
import uuid
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, TypeVar, Unpack

import msgspec
import numpy as np
from numpy.typing import NDArray
from xxhash import xxh3_128_digest

from renderers.art.quality import ClassificationName
from renderers.scene import AirSurface, Camera, Material, Scene, Volume
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.lease import LEASE_S
from renderers.snapshots.request import (
    REQUEST_SCHEMA,
    CameraSpec,
    ClassicWork,
    DeflectorSpec,
    GridSpec,
    ImageSpec,
    InstrumentSpec,
    LightSpec,
    MaterialName,
    NodeSpec,
    PathTracingSpec,
    Point,
    ProjectionName,
    QualityName,
    Row,
    Samples,
    ScopeWork,
    SnapshotRequest,
    SnapshotResult,
    WoundsSpec,
)
from renderers.snapshots.spool import JobState, JobStatus, Spool
from renderers.snapshots.volume_changes import FrozenSurface, Offsets, VolumeChanges
from system import UserError, foreign_file

POLL_S = 0.05

Scalar = TypeVar("Scalar", bound=np.generic)


class SnapshotError(RuntimeError):
    """A snapshot did not come; the message says why."""


class SnapshotCancelledError(SnapshotError):
    """The snapshot was cancelled by its client."""


class WorkerLostError(SnapshotError):
    """The worker that drew the snapshot fell silent."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Find a finished picture: `folder` holds picture.png and the arrays.

    What the arrays are says `renderers.snapshots.delivery.Picture`.
    """

    folder: Path
    result: SnapshotResult

    @property
    def picture(self) -> Path:
        """Return the PNG file."""
        return self.folder / "picture.png"

    def pixels(self) -> NDArray[np.uint8]:
        """Read the picture, ``(h, w, 3)`` sRGB."""
        from PIL import Image as PngImage

        path = self.picture
        with foreign_file(path, "a picture"), PngImage.open(path) as image:
            return np.asarray(image.convert("RGB"))

    def radiance(self) -> NDArray[np.float32]:
        """Read linear radiance."""
        return _load(self.folder / "radiance.npy", np.float32)

    def coverage(self) -> NDArray[np.float32]:
        """Read alpha, ``(h, w)``."""
        return _load(self.folder / "coverage.npy", np.float32)

    def samples(self) -> NDArray[np.uint32]:
        """Read how many rays, or paths, each pixel had, ``(h, w)``."""
        return _load(self.folder / "samples.npy", np.uint32)

    def state(self) -> NDArray[np.float64]:
        """Read what light by paths can go on from."""
        return _load(self.folder / "paths.npy", np.float64)

    def depth_mm(self) -> NDArray[np.float32]:
        """Read distances along the rays, ``(h, w)``, +inf where nothing is."""
        return _load(self.folder / "depth.npy", np.float32)


class RequestOptions(TypedDict, total=False):
    """What may be said of any request; see `SnapshotRequest`."""

    quality: QualityName
    classification: ClassificationName
    tolerance: float | None
    deflectors: tuple[DeflectorSpec, ...]
    priority: int
    max_seconds: float
    deadline_s: float | None
    progressive: bool
    deliver_after_s: float | None


class SnapshotClient:
    """Put requests into a spool folder and wait for what comes out.

    lease_s: silence after which a worker counts as dead.
    """

    def __init__(
        self, folder: Path, *, name: str = "", lease_s: float = LEASE_S
    ) -> None:
        """Raise SpoolError when the folder cannot be used."""
        self.spool = Spool(folder)
        self._name = name
        self._lease_s = lease_s
        self._digests: dict[tuple[str, tuple[int, ...], bytes], str] = {}

    @property
    def data(self) -> DataStore:
        """Return the store of the arrays that requests name."""
        return self.spool.data

    def request_scope(
        self,
        surface: AirSurface | FrozenSurface,
        camera: Camera,
        *,
        samples: Samples = 4,
        ring_radius_mm: float = 1.45,
        light_power: float = 1.0,
        seed: int = 7,
        blood_bias: float = 1.0,
        gain: float | None = None,
        frame_number: int = 0,
        instruments: Iterable[PlacedMesh] = (),
        path_tracing: PathTracingSpec | None = None,
        **options: Unpack[RequestOptions],
    ) -> SnapshotRequest:
        """Make a request for what the endoscope sees; stores its volumes.

        surface: of a head that is operated on, as it is now, or as it was frozen;
        with it go the bricks that differ from the head before, since whole volumes
        would have to be hashed, and a log of edits repeated by the worker. instruments:
        meshes with their rigid world-from-mesh transforms. Others as in `ScopeWork` and
        `SnapshotRequest`.
        """
        frozen = surface
        if isinstance(frozen, AirSurface):
            frozen = FrozenSurface.of(frozen)
        surface = frozen.surface
        distance, wounds = surface.distance, None
        if surface.wounds is not None:
            distance = surface.wounds.pristine
            wounds = WoundsSpec(
                flesh=self.put(surface.wounds.flesh.values),
                bone=self.put(surface.wounds.bone.values),
                deep=self.put(surface.wounds.deep.values),
                film=self._put_changes(frozen.film),
                bent=self._put_changes(frozen.bent),
                rest=self._put_offsets(frozen.offsets),
                pale=self._put_changes(frozen.pale),
            )
        work = ScopeWork(
            distance=self.put(distance.values),
            changes=self._put_changes(frozen.distance),
            wounds=wounds,
            blood=self.put(surface.blood.values),
            skin=self.put(surface.skin.values),
            grid=_grid(surface.distance),
            ring_radius_mm=ring_radius_mm,
            light_power=light_power,
            seed=seed,
            blood_bias=blood_bias,
            gain=gain,
            frame_number=frame_number,
            instruments=self._placed(instruments),
            path_tracing=path_tracing,
        )
        return self._request(work, camera, samples, options)

    def request_classic(
        self,
        scene: Scene,
        camera: Camera,
        *,
        samples: Samples = 1,
        background: tuple[float, float, float] = (0.0, 0.0, 0.0),
        instruments: Iterable[PlacedMesh] = (),
        changes: VolumeChanges | None = None,
        **options: Unpack[RequestOptions],
    ) -> SnapshotRequest:
        """Make a request for mode classic; stores its volume.

        instruments: as in `request_scope`. changes: bricks of an edited volume that
        differ from the scene's.
        """
        transfer, material = scene.transfer_function, scene.material
        work = ClassicWork(
            volume=self.put(scene.volume.values),
            changes=self._put_changes(changes),
            grid=_grid(scene.volume),
            nodes=tuple(
                NodeSpec(float(d), _three(c), float(k))
                for d, c, k in zip(
                    transfer.nodes, transfer.color, transfer.kappa_per_mm, strict=True
                )
            ),
            lights=tuple(
                LightSpec(_three(light.vector), _three(light.color), light.is_local)
                for light in scene.lights
            ),
            ambient=material.ambient,
            diffuse=material.diffuse,
            specular=material.specular,
            shininess=material.shininess,
            background=background,
            instruments=self._placed(instruments),
        )
        return self._request(work, camera, samples, options)

    def put(self, array: NDArray[np.generic]) -> str:
        """Store an array for requests to name; return its digest.

        What was stored once is known again by a quick hash: XXH3 reads 24 MB in a
        millisecond, SHA-256 in 14.
        """
        bits = xxh3_128_digest(np.ascontiguousarray(array).data)
        mark = array.dtype.str, array.shape, bits
        digest = self._digests.get(mark)
        if digest is None or not self.data.touch(digest):
            digest = self._digests[mark] = self.data.put(array)
        return digest

    def _put_changes(self, changes: VolumeChanges | None) -> str | None:
        """Store bricks; None where there are none."""
        return self.put(changes.record()) if changes else None

    def _put_offsets(
        self, offsets: Offsets | None
    ) -> tuple[str | None, str | None, str | None] | None:
        """Store bricks of offsets along three axes; None where there are none."""
        if offsets is None:
            return None
        x, y, z = (self._put_changes(part) for part in offsets)
        return x, y, z

    def submit(self, request: SnapshotRequest) -> str:
        """Queue a request; return its id. Submitting it again changes nothing."""
        self.spool.publish(request)
        return request.id

    def cancel(self, job_id: str) -> None:
        """Ask for a job's end."""
        self.spool.ask_cancel(job_id)

    def finish(self, job_id: str) -> None:
        """Ask for the best picture so far."""
        self.spool.ask_finish(job_id)

    def lost(self, job_id: str) -> str:
        """Return a sentence where the worker drawing a job fell silent, else ""."""
        return self._lost(job_id, self.spool.status(job_id))

    def _lost(self, job_id: str, status: JobStatus) -> str:
        if status.state is not JobState.RUNNING or not self.spool.is_stale(
            job_id, status, self._lease_s
        ):
            return ""
        return (
            f"The worker drawing snapshot {job_id} has given no sign of life for "
            f"{self._lease_s:g} s; start another worker to take it over."
        )

    def wait(
        self,
        job_id: str,
        progress: Callable[[float], None] | None = None,
        timeout_s: float | None = None,
        watch: Callable[[], None] | None = None,
    ) -> Snapshot:
        """Wait until a job has ended; return its picture.

        progress: told the share done. watch: called at every look; whoever started
        the worker raises here when it has died, and whoever shows a `GrowingPicture`
        updates it. Raise SnapshotError (or its kinds) when no picture comes,
        WorkerLostError when the worker fell silent and no other has taken the job over
        within `timeout_s`, or within a lease where there is none.
        """
        began = time.monotonic()
        patience_s = self._lease_s if timeout_s is None else timeout_s
        shown = -1.0
        while True:
            status = self.spool.status(job_id)
            if progress and status.done != shown:
                shown = status.done
                progress(shown)
            if status.state is JobState.DONE:
                folder = self.spool.attempt_folder(job_id)
                return Snapshot(folder, self.spool.result(job_id))
            if status.state is JobState.CANCELLED:
                raise SnapshotCancelledError(f"Snapshot {job_id} was cancelled.")
            if status.state.is_final:
                raise SnapshotError(
                    f"Snapshot {job_id} was {status.state.value}: {status.message}."
                )
            waited_s = time.monotonic() - began
            lost = self._lost(job_id, status)
            if lost and waited_s > patience_s:
                raise WorkerLostError(lost)
            if watch:
                watch()
            if timeout_s is not None and waited_s > timeout_s and not lost:
                raise SnapshotError(
                    f"Snapshot {job_id} is still {status.state.value} after "
                    f"{timeout_s:g} s; is a worker serving {self.spool.folder}?"
                )
            time.sleep(POLL_S)

    def _placed(self, instruments: Iterable[PlacedMesh]) -> tuple[InstrumentSpec, ...]:
        specs = []
        for mesh, pose in instruments:
            if mesh.material is Material.TISSUE:
                raise UserError("an instrument cannot be made of TISSUE")
            shape = self.put(mesh.vertices), self.put(mesh.faces)
            material = msgspec.convert(mesh.material.name, MaterialName)
            rows = (_four(pose[0]), _four(pose[1]), _four(pose[2]))
            capsules = None if mesh.capsules is None else self.put(mesh.capsules)
            specs.append(InstrumentSpec(*shape, material, rows, capsules))
        return tuple(specs)

    def _request(
        self,
        work: ScopeWork | ClassicWork,
        camera: Camera,
        samples: Samples,
        options: RequestOptions,
    ) -> SnapshotRequest:
        return SnapshotRequest(
            schema=REQUEST_SCHEMA,
            id=uuid.uuid4().hex,
            camera=CameraSpec(
                _three(camera.eye_mm),
                _three_rows(camera.frame[1:]),
                camera.extent,
                msgspec.convert(camera.projection.name.lower(), ProjectionName),
                (camera.distortion.k1, camera.distortion.k2),
            ),
            image=ImageSpec(camera.width, camera.height, samples),
            work=work,
            client=self._name,
            **options,
        )


def _three(vector: NDArray[np.float64]) -> Point:
    x, y, z = (float(v) for v in vector)
    return x, y, z


def _four(row: NDArray[np.float64]) -> Row:
    return *_three(row[:3]), float(row[3])


def _three_rows(matrix: NDArray[np.float64]) -> tuple[Point, Point, Point]:
    return _three(matrix[0]), _three(matrix[1]), _three(matrix[2])


def _grid(volume: Volume) -> GridSpec:
    return GridSpec(
        _three(volume.spacing_mm),
        _three(volume.origin_mm),
        _three_rows(volume.direction),
    )


def _load(path: Path, kind: type[Scalar]) -> NDArray[Scalar]:
    with foreign_file(path, "an array of a snapshot"):
        array: NDArray[Scalar] = np.load(path, allow_pickle=False)
    if array.dtype != kind:
        raise UserError(f"{path} holds {array.dtype}, expected {kind.__name__}")
    return array
