"""A ray tracer's stand-in, for who only asks for pictures; a picture to ask for."""

import numpy as np

from paravol.snapshots.head_scene import RenderSettings
from paravol.snapshots.outputs import RenderedPicture
from paravol.snapshots.view_file import PhantomHead, ScopeLook, ViewCamera, ViewFile
from renderers.scene import Camera, Projection, Scene, TransferFunction, Volume
from renderers.shading import meter
from renderers.snapshots.client import SnapshotClient
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


def ask(client: SnapshotClient) -> str:
    """Ask for a small picture of a cube; return the number of the job."""
    values = np.zeros((12, 12, 12), np.float32)
    values[3:9, 3:9, 3:9] = 1.0
    opaque = TransferFunction(
        np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 1.0])
    )
    scene = Scene(Volume(values, np.ones(3), np.zeros(3), background=0.0), opaque)
    camera = Camera.looking_at(
        (5.5, -20, 5.5),
        (5.5, 5.5, 5.5),
        extent=0.4,
        size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )
    return client.submit(client.request_classic(scene, camera))


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
