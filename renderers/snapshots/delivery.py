"""From what was traced to the files of a finished job."""

import hashlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.tracer import RenderStoppedError
from renderers.scene import (
    AirSurface,
    Camera,
    GBuffer,
    Image,
    Scene,
    save_png,
)
from renderers.scene.mesh import PlacedMesh
from renderers.shading import (
    CameraPass,
    Caster,
    ScopeLight,
    ScopeShader,
    Tier,
    downsample_gbuffer,
    downsample_radiance,
)
from renderers.shading.path_sampling import PathSampling
from renderers.shading.path_tracer import BATCH_PATHS, PathLight, PathTracer, SeenWalls
from renderers.snapshots.data_store import DataStore, make_last, npy_record, write_whole
from renderers.snapshots.request import (
    ClassicWork,
    PathTracingSpec,
    ScopeWork,
    SnapshotRequest,
)
from renderers.snapshots.saved_work import SavedWork
from renderers.snapshots.scene_loader import instrument_meshes, seen_surface
from renderers.snapshots.team import Progress, Traced, traced_camera

LARGEST_STATE = 8 << 30
"""Bytes of a state accepted."""

LOOK_EVERY = 8
"""Batches of blocks between two looks at the noise and at the spool: some 50 ms."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """What is asked, and kept, while a picture is drawn.

    go_on: told the share done; answers whether to go on. enough: whether the best
    picture so far will do. saved: what is kept for whoever takes the job over, and was
    by those before.
    """

    go_on: Progress = lambda share: True
    enough: Callable[[], bool] = lambda: False
    saved: SavedWork | None = None


@dataclass(frozen=True, slots=True)
class Picture:
    """A finished picture.

    pixels: ``(h, w, 3)`` uint8 sRGB. radiance: float32 linear, ``(h, w, 3)`` before
    the camera in mode scope, premultiplied ``(h, w, 4)`` in mode classic. depth_mm:
    ``(h, w)`` float32 along the rays. coverage: ``(h, w)`` float32, alpha. samples:
    ``(h, w)`` uint32 rays of each pixel; with light by random paths, paths. gain: of
    the camera, None in mode classic. complete, noise: as in `SnapshotResult`. state: of
    the paths, to go on from. error: as in `SnapshotResult`.
    """

    pixels: NDArray[np.uint8]
    radiance: NDArray[np.float32]
    depth_mm: NDArray[np.float32]
    coverage: NDArray[np.float32]
    samples: NDArray[np.uint32]
    gain: float | None
    complete: bool = True
    noise: float | None = None
    state: NDArray[np.float64] | None = None
    error: float | None = None


@dataclass(frozen=True, slots=True)
class ScopeView:
    """What lights a view: the camera of its rays, the light, tools in it."""

    camera: Camera
    light: ScopeLight
    shader: ScopeShader
    tools: list[PlacedMesh]

    @property
    def casters(self) -> list[Caster]:
        """Return what casts shadows."""
        return [Caster.of(mesh, pose) for mesh, pose in self.tools]

    def shaded(
        self, gbuffer: GBuffer, bounced: PathLight | None = None
    ) -> NDArray[np.float32]:
        """Return the radiance of what rays found, tools among it.

        bounced: light from wall to wall, where it is known; None for the quick one.
        """
        return self.shader.shade(
            gbuffer, self.camera, self.light, bounced, self.casters
        )

    def walls(self, gbuffer: GBuffer) -> SeenWalls:
        """Return the walls that light is followed to."""
        weight = self.shader.reflectance(gbuffer, self.camera, self.light)
        return SeenWalls.of(gbuffer, self.camera, self.light, weight)

    def with_tools(self, found: GBuffer) -> GBuffer:
        """Put the tools before or behind what rays found."""
        for mesh, pose in self.tools:
            found = found.nearest(mesh.gbuffer(self.camera, pose))
        return found


class _Paths(NamedTuple):
    """What paths found; see `SnapshotResult` for complete and noise."""

    light: PathLight
    complete: bool
    noise: float | None
    state: NDArray[np.float64]


def path_tracing_of(request: SnapshotRequest) -> PathTracingSpec | None:
    """Return a request's path tracing, None in other modes."""
    return request.work.path_tracing if isinstance(request.work, ScopeWork) else None


class Finisher:
    """Shade what was traced; keep what the next picture of the same case can use."""

    def __init__(self, data: DataStore, threads: int = 2) -> None:
        self._data = data
        self._threads = threads
        self._kept: tuple[bytes, ScopeShader] | None = None
        self._camera = CameraPass(threads=threads)

    def finish(
        self,
        request: SnapshotRequest,
        scene: Scene,
        traced: Traced,
        attempt: Attempt | None = None,
    ) -> Picture:
        """Light and expose mode scope; put mode classic before its background.

        attempt: asked while light is followed by paths. RenderStoppedError when it may
        not go on.
        """
        found, work = traced.found, request.work
        if isinstance(work, ClassicWork):
            assert isinstance(found, Image)
            return self._classic(request, work, found)
        assert isinstance(found, GBuffer)
        return self._scope(request, work, scene, found, attempt or Attempt())

    def close(self) -> None:
        """End the threads."""
        self._camera.close()
        self._forget_shader()

    def _classic(
        self, request: SnapshotRequest, work: ClassicWork, image: Image
    ) -> Picture:
        assert image.depth_mm is not None
        rgba, depth = image.rgba, image.depth_mm
        if request.image.samples == 4:
            rgba = downsample_radiance(rgba)
            depth = np.minimum.reduce(
                [depth[r::2, c::2] for r in (0, 1) for c in (0, 1)]
            )
        pixels = Image(rgba).to_srgb8(work.background)
        return Picture(
            pixels,
            rgba,
            np.ascontiguousarray(depth),
            np.ascontiguousarray(rgba[..., 3]),
            np.full(depth.shape, request.image.samples, np.uint32),
            None,
        )

    def _scope(
        self,
        request: SnapshotRequest,
        work: ScopeWork,
        scene: Scene,
        found: GBuffer,
        attempt: Attempt,
    ) -> Picture:
        sight = self.sight(request, work, scene)
        gbuffer = sight.with_tools(found)
        radiance = sight.shaded(gbuffer)
        paths = error = None
        size = request.image.height, request.image.width
        samples = np.full(size, request.image.samples, np.uint32)
        if work.path_tracing is not None:
            surface = seen_surface(request, scene)
            paths = self._follow(
                work, work.path_tracing, surface, sight.walls(gbuffer), attempt
            )
            assert paths.light.batches is not None
            known = paths.light.batches > 0
            by_paths = sight.shaded(gbuffer, paths.light)
            told = known & in_field(gbuffer.coverage)
            pair = radiance[told], by_paths[told]
            radiance = np.where(known[..., None], by_paths, radiance)
            samples = added_up(request, paths.light.batches) * np.uint32(BATCH_PATHS)
        if request.image.samples == 4:
            radiance = downsample_radiance(radiance)
            gbuffer = downsample_gbuffer(gbuffer)
        pixels, gain = self.expose(request, work, radiance, gbuffer)
        if paths is not None and paths.noise is None and len(pair[0]):
            # where paths were walked they tell what the quick light, which stands in
            # for them elsewhere, is off by; their own noise is in it
            quick, by_paths = (eye_codes(part, gain) for part in pair)
            error = float(np.sqrt(np.mean((quick - by_paths) ** 2)))
        depth, coverage = gbuffer.depth_mm, gbuffer.coverage
        picture = Picture(pixels, radiance, depth, coverage, samples, gain, error=error)
        if paths is None:
            return picture
        return replace(
            picture, complete=paths.complete, noise=paths.noise, state=paths.state
        )

    def _follow(
        self,
        work: ScopeWork,
        spec: PathTracingSpec,
        surface: AirSurface,
        walls: SeenWalls,
        attempt: Attempt,
    ) -> _Paths:
        """Walk paths until noise or number is reached, or it is enough.

        Raise RenderStoppedError when the attempt may not go on, UserError for a state
        that is not this view's.
        """
        saved = attempt.saved
        state = None if saved is None else saved.paths()
        if state is None and spec.state is not None:
            stored = self._data.get(spec.state, ("float64",), LARGEST_STATE)
            state = np.asarray(stored)
        tracer = PathTracer(
            surface, blood_bias=work.blood_bias, seed=work.seed, threads=self._threads
        )
        with closing(tracer):
            sampling = PathSampling(tracer, walls, state)
            most = sampling.blocks * -(-spec.paths // BATCH_PATHS)
            while True:
                noise, done = sampling.noise(), sampling.batches
                if not attempt.go_on(0.05 + 0.95 * min(done / max(most, 1), 1.0)):
                    raise RenderStoppedError()
                is_whole = sampling.is_complete and done >= most
                complete = noise <= spec.noise or is_whole
                if complete or attempt.enough():
                    known = noise if np.isfinite(noise) else None
                    return _Paths(sampling.light(), complete, known, sampling.state())
                if saved is not None:
                    saved.watch_paths(sampling.state)
                for _ in range(min(LOOK_EVERY, max(most - done, 1))):
                    sampling.step()

    def sight(
        self, request: SnapshotRequest, work: ScopeWork, scene: Scene
    ) -> "ScopeView":
        """Set up what lights the rays of a request."""
        return ScopeView(
            traced_camera(request),
            ScopeLight(work.ring_radius_mm, power=work.light_power),
            self._shader(request, work, scene),
            instrument_meshes(self._data, work.instruments),
        )

    def expose(
        self,
        request: SnapshotRequest,
        work: ScopeWork,
        radiance: NDArray[np.float32],
        gbuffer: GBuffer,
    ) -> tuple[NDArray[np.uint8], float]:
        """Expose one radiance a pixel; return the picture and the gain."""
        return self._camera.finish(
            radiance,
            gbuffer,
            request.to_camera(),
            gain=work.gain,
            frame_number=work.frame_number,
            lens=work.lens,
        )

    def _shader(
        self, request: SnapshotRequest, work: ScopeWork, scene: Scene
    ) -> ScopeShader:
        tier = Tier.SNAPSHOT if request.image.samples == 4 else Tier.FULL
        head = work.distance, work.changes, work.blood, work.skin, work.grid
        how = work.wounds, work.seed, work.blood_bias, request.deflectors
        key = msgspec.json.encode((head, how))
        if self._kept is None or self._kept[0] != key:
            self._forget_shader()
            surface = seen_surface(request, scene)
            shader = ScopeShader(
                surface, tier, work.seed, work.blood_bias, self._threads
            )
            self._kept = key, shader
        _, shader = self._kept
        shader.tier = tier
        return shader

    def _forget_shader(self) -> None:
        if self._kept is not None:
            self._kept[1].close()
            self._kept = None


def eye_codes(radiance: NDArray[np.float32], gain: float) -> NDArray[np.float32]:
    """Encode light as the eye weighs it, in codes of 255."""
    light = np.clip(radiance * np.float32(gain), 0, 1)
    return np.asarray(255 * light ** np.float32(1 / 2.2))


def in_field(coverage: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Mark the pixels ``(h, w)`` of an endoscope's picture that show something.

    Beyond the field's stop nothing is shown.
    """
    half = min(coverage.shape) / 2
    rows, columns = ((np.arange(n) + 0.5 - n / 2) / half for n in coverage.shape)
    inside = np.hypot(rows[:, None], columns[None]) <= 1
    return np.asarray((coverage > 0) & inside)


def write_picture(
    folder: Path, request: SnapshotRequest, picture: Picture
) -> dict[str, str]:
    """Write a picture's files; return their SHA-256 by name.

    Their bytes are on the disk then; their names are when the folder's last one is.
    """
    text = {"Title": f"PARAVOL snapshot {request.id}", "Software": "PARAVOL"}
    save_png(folder / "picture.png", picture.pixels, text)
    arrays: dict[str, NDArray[np.generic]] = {
        "radiance.npy": picture.radiance,
        "depth.npy": picture.depth_mm,
        "coverage.npy": picture.coverage,
        "samples.npy": picture.samples,
    }
    if picture.state is not None:
        arrays["paths.npy"] = picture.state
    for name, array in arrays.items():
        write_whole(folder / name, npy_record(array), lasting=False)
    files = [folder / name for name in ("picture.png", *arrays)]
    make_last(*files)
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def added_up(
    request: SnapshotRequest, plane: NDArray[np.generic]
) -> NDArray[np.uint32]:
    """Add up what the rays of each pixel have."""
    counts = plane.astype(np.uint32)
    if request.image.samples == 1:
        return counts
    rows = counts[0::2] + counts[1::2]
    total: NDArray[np.uint32] = rows[:, 0::2] + rows[:, 1::2]
    return total
