"""From what was traced to the files of a finished job."""

import hashlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from renderers.art.data_store import DataStore
from renderers.art.files import write_whole
from renderers.art.job import ClassicWork, ScopeWork, SnapshotRequest
from renderers.art.stage import instruments_gbuffer
from renderers.art.team import Traced, traced_camera
from renderers.scene import GBuffer, Image, Scene, save_png
from renderers.shading import (
    CameraPass,
    ScopeLight,
    ScopeShader,
    Tier,
    downsample_gbuffer,
    downsample_radiance,
)


@dataclass(frozen=True, slots=True)
class Picture:
    """Hold a finished picture.

    pixels: ``(h, w, 3)`` uint8 sRGB. radiance: float32 linear, ``(h, w, 3)`` before
    the camera in mode scope, premultiplied ``(h, w, 4)`` in mode classic. depth_mm:
    ``(h, w)`` float32 along the rays. gain: of the camera, None in mode classic.
    """

    pixels: NDArray[np.uint8]
    radiance: NDArray[np.float32]
    depth_mm: NDArray[np.float32]
    gain: float | None


class Finisher:
    """Shade what was traced; keep what the next picture of the same case can use."""

    def __init__(self, data: DataStore, threads: int = 2) -> None:
        self._data = data
        self._threads = threads
        self._kept: tuple[bytes, ScopeShader] | None = None
        self._camera = CameraPass(threads=threads)

    def finish(self, request: SnapshotRequest, scene: Scene, traced: Traced) -> Picture:
        """Light and expose mode scope; put mode classic before its background."""
        found, work = traced.found, request.work
        if isinstance(work, ClassicWork):
            assert isinstance(found, Image)
            return self._classic(request, work, found)
        assert isinstance(found, GBuffer)
        return self._scope(request, work, scene, found)

    def close(self) -> None:
        """End the threads."""
        self._camera.close()
        if self._kept is not None:
            self._kept[1].close()
            self._kept = None

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
        return Picture(pixels, rgba, np.ascontiguousarray(depth), None)

    def _scope(
        self, request: SnapshotRequest, work: ScopeWork, scene: Scene, found: GBuffer
    ) -> Picture:
        fine = traced_camera(request)
        instruments = instruments_gbuffer(self._data, work.instruments, fine)
        gbuffer = found.nearest(instruments)
        light = ScopeLight(work.ring_radius_mm, power=work.light_power)
        radiance = self._shader(request, work, scene).shade(gbuffer, fine, light)
        if request.image.samples == 4:
            radiance = downsample_radiance(radiance)
            gbuffer = downsample_gbuffer(gbuffer)
        pixels, gain = self._camera.finish(
            radiance,
            gbuffer,
            request.to_camera(),
            gain=work.gain,
            frame_number=work.frame_number,
        )
        return Picture(pixels, radiance, gbuffer.depth_mm, gain)

    def _shader(
        self, request: SnapshotRequest, work: ScopeWork, scene: Scene
    ) -> ScopeShader:
        tier = Tier.SNAPSHOT if request.image.samples == 4 else Tier.FULL
        key = msgspec.json.encode(
            (
                work.distance,
                work.blood,
                work.skin,
                work.grid,
                work.seed,
                work.blood_bias,
                tier.name,
            )
        )
        if self._kept is None or self._kept[0] != key:
            if self._kept is not None:
                self._kept[1].close()
                self._kept = None
            if scene.surface is None:
                raise ValueError("the scene has no air surface; mode scope needs one")
            shader = ScopeShader(
                scene.surface, tier, work.seed, work.blood_bias, self._threads
            )
            self._kept = key, shader
        return self._kept[1]


def write_picture(
    folder: Path, request: SnapshotRequest, picture: Picture
) -> dict[str, str]:
    """Write a picture's three files; return their SHA-256 by name."""
    text = {"Title": f"PARAVOL snapshot {request.id}", "Software": "PARAVOL"}
    save_png(folder / "picture.png", picture.pixels, text)
    write_whole(folder / "radiance.npy", _npy(picture.radiance))
    write_whole(folder / "depth.npy", _npy(picture.depth_mm))
    return {
        name: hashlib.sha256((folder / name).read_bytes()).hexdigest()
        for name in ("picture.png", "radiance.npy", "depth.npy")
    }


def _npy(array: NDArray[Any]) -> bytes:
    buffer = io.BytesIO()
    npy.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getvalue()
