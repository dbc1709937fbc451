"""A ray tracer's stand-in, for who only asks it for pictures."""

import numpy as np

from paravol.snapshots.head_scene import RenderSettings
from paravol.snapshots.outputs import RenderedPicture
from paravol.snapshots.view_file import PhantomHead, ScopeLook, ViewCamera, ViewFile
from renderers.shading import meter
from renderers.snapshots.request import RESULT_SCHEMA, SnapshotResult

SIZE = 16


def view(gain: float | None = None) -> ViewFile:
    camera = ViewCamera((0.0, 0.0, 0.0), 0.7, target_mm=(0.0, 1.0, 0.0))
    return ViewFile(
        schema="paravol.view/1",
        head=PhantomHead(),
        camera=camera,
        size_px=(SIZE, SIZE),
        look=ScopeLook(gain=gain),
    )


class Darkroom:
    """Stand in for a ray tracer that sees a wall come near: light by number."""

    interrupted = False

    def __init__(self, light: list[float]) -> None:
        self.gains: list[float | None] = []
        self._light = light

    def progress(self, stage: str, share: float) -> None:
        pass

    def draw(
        self, view: ViewFile, settings: RenderSettings, stage: str
    ) -> tuple[RenderedPicture, str]:
        assert isinstance(view.look, ScopeLook)
        light = np.full((SIZE, SIZE, 4), self._light[len(self.gains)], np.float32)
        self.gains.append(view.look.gain)
        result = SnapshotResult(
            schema=RESULT_SCHEMA,
            id="0" * 32,
            mode="scope",
            width=SIZE,
            height=SIZE,
            ranks=1,
            attempt=1,
            gain=view.look.gain or meter(light[..., :3]),
            complete=True,
            traced=1.0,
            noise=None,
            error=None,
            seconds={"total": 0.0},
            counters={},
            digests={},
        )
        plane = np.ones((SIZE, SIZE), np.float32)
        pixels = np.zeros((SIZE, SIZE, 3), np.uint8)
        samples = np.ones((SIZE, SIZE), np.uint32)
        return RenderedPicture(view, result, pixels, light, plane, samples), ""
