"""What a client sees before its picture is finished."""

import time
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.regions import Gather, Region
from renderers.scene import GBuffer, Image, Scene
from renderers.snapshots.delivery import Finisher
from renderers.snapshots.filling import fill
from renderers.snapshots.growing import TILE_PX, TileWriter
from renderers.snapshots.request import ImageSpec, ScopeWork, SnapshotRequest
from renderers.snapshots.team import Progress
from renderers.snapshots.traced import Traced, found_by

SHARE = 0.1
"""Of the time so far, that may go into shading what is then shaded again."""

FIRST_S = 0.25
"""A picture that is finished sooner is not shown in parts."""


class Preview(AbstractContextManager["Preview"]):
    """Show coarse pictures, then finished parts of the picture itself.

    None of it touches the picture: parts are shaded anew when all are there.
    """

    def __init__(
        self, folder: Path, request: SnapshotRequest, scene: Scene, finisher: Finisher
    ) -> None:
        """Show nothing of a request that is not progressive.

        folder: the attempt's.
        """
        self._request = request
        self._scene = scene
        self._finisher = finisher
        self._tiles = TileWriter(folder) if request.progressive else None
        image = request.image
        self._whole = Region(0, 0, image.width, image.height)
        self._waiting = [
            Region(x, y, min(x + TILE_PX, image.width), min(y + TILE_PX, image.height))
            for y in range(0, image.height, TILE_PX)
            for x in range(0, image.width, TILE_PX)
        ]
        self._coarse: GBuffer | Image | None = None
        self._gain: float | None = None
        self._began = time.monotonic()
        self._spent_s = 0.0

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._tiles is not None:
            self._tiles.close()

    def show_coarse(self, request: SnapshotRequest, found: GBuffer | Image) -> None:
        """Show a coarse picture in place of the whole.

        request: for just that coarse picture.
        """
        if self._tiles is not None:
            picture = self._finisher.finish(
                _by_quick_light(request), self._scene, Traced(found, {})
            )
            self._tiles.add(self._whole, picture.pixels)
            self._coarse, self._gain = found, picture.gain

    def show_picture(self, pixels: NDArray[np.uint8]) -> None:
        """Show a picture of the final size that is not final."""
        if self._tiles is not None:
            self._tiles.add(self._whole, pixels)

    def looking_at(self, gather: Gather, progress: Progress) -> Progress:
        """Show what is gathered whenever progress is told and there is time for it."""
        if self._tiles is None:
            return progress

        def go_on(share: float) -> bool:
            elapsed = time.monotonic() - self._began
            if elapsed > FIRST_S and self._spent_s < SHARE * elapsed:
                self.show_parts(gather)
            return progress(share)

        return go_on

    def show_parts(self, gather: Gather) -> None:
        """Shade one sample a pixel of what is there; show the parts that are new."""
        assert self._tiles is not None
        began = time.monotonic()
        step = 2 if self._request.image.samples == 4 else 1
        done = gather.done[::step, ::step]
        fresh = [r for r in self._waiting if done[r.rows, r.columns].all()]
        if fresh:
            part = Gather(self._whole.right, self._whole.bottom)
            part.value = np.ascontiguousarray(gather.value[::step, ::step])
            part.depth = np.ascontiguousarray(gather.depth[::step, ::step])
            part.solids = gather.solids and gather.solids.every(step)
            single = self._single()
            found = found_by(single, self._scene, part)
            if self._coarse is not None:
                # else the camera's blur would draw a dark rim round each part
                found = fill(found, done, self._coarse)
            pixels = self._finisher.finish(
                single, self._scene, Traced(found, {})
            ).pixels
            for region in fresh:
                self._tiles.add(region, pixels[region.rows, region.columns])
            shown = set(fresh)
            self._waiting = [region for region in self._waiting if region not in shown]
        self._spent_s += time.monotonic() - began

    def _single(self) -> SnapshotRequest:
        """Ask for one sample a pixel, exposed as the coarse pictures were.

        A camera that metered what happens to be there would flicker.
        """
        request = _by_quick_light(self._request)
        work = request.work
        if isinstance(work, ScopeWork) and work.gain is None:
            work = msgspec.structs.replace(work, gain=self._gain)
        image = ImageSpec(self._whole.right, self._whole.bottom, 1)
        return msgspec.structs.replace(request, image=image, work=work)


def _by_quick_light(request: SnapshotRequest) -> SnapshotRequest:
    """Leave out light by paths, which takes longer than all the rest."""
    work = request.work
    if isinstance(work, ScopeWork):
        work = msgspec.structs.replace(work, truth=None)
    return msgspec.structs.replace(request, work=work)
