"""How the ray tracer's cost grows with voxels and with pixels.

Each sweep changes one quantity; the report fits a power to its times: 1 for voxels
would be the cost of looking at every voxel.
"""

from functools import partial

import numpy as np

from benchmarks.plan import Measured, Plan, Task
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer, Quality
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
    four_lights,
)

EDGE_MM = 200.0
SIZES = (64, 128, 256, 512)
PICTURES = (128, 256, 512, 1024)
USUAL_SIZE, USUAL_PICTURE = 128, 256
STEP = 0.5
KAPPA = 1.0
"""Extinction of the shells, per mm."""
SHELLS = 4


def shells(size: int) -> Volume:
    """Fill a cube with wavy shells, air between them; int16."""
    axis = np.linspace(-1, 1, size, dtype=np.float32)
    y, x = axis[:, None], axis[None]
    values = np.empty((size, size, size), np.int16)
    for plane, z in zip(values, axis, strict=True):
        r = np.sqrt(x**2 + y**2 + z**2) + 0.05 * np.sin(9 * x) * np.cos(7 * y + 5 * z)
        plane[:] = 1000 * np.sin(np.pi * (2 * SHELLS * r + 0.5))
    h = EDGE_MM / (size - 1)
    return Volume(values, np.full(3, h), np.full(3, -EDGE_MM / 2))


def shell_scene(volume: Volume, *, lit: bool) -> Scene:
    """Classify the upper part of the waves as tissue."""
    transfer = TransferFunction(
        np.array([300.0, 700.0]),
        np.array([[0.7, 0.3, 0.2], [0.9, 0.8, 0.7]]),
        np.array([0.0, KAPPA]),
    )
    if lit:
        return Scene(volume, transfer, four_lights())
    return Scene(volume, transfer, (), PhongMaterial(1.0, 0.0, 0.0))


def shell_camera(pixels: int) -> Camera:
    """Look at the cube from outside with a square picture."""
    return Camera.looking_at(
        [-300.0, -260.0, 150.0],
        [0.0, 0.0, 0.0],
        extent=0.3,
        size=(pixels, pixels),
        projection=Projection.PERSPECTIVE,
    )


class GrowthPlan(Plan, suite="art-growth"):
    """List and make the measurements of suite `art-growth`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._last = 2 if quick else 4
        self._budget_s = 0.2 if quick else 1.0

    def tasks(self) -> list[Task]:
        """List the sweeps."""
        sweeps = [("voxels", n**3, n, USUAL_PICTURE) for n in SIZES[: self._last]]
        sweeps += [("pixels", n**2, USUAL_SIZE, n) for n in PICTURES[: self._last]]
        return [
            self._task(name, at, lit, size, pixels)
            for lit in (False, True)
            for name, at, size, pixels in sweeps
        ]

    def _task(self, sweep: str, at: float, lit: bool, size: int, pixels: int) -> Task:
        case = f"shells/{'four lights' if lit else 'no lights'}/{sweep}"
        return self.task(
            case,
            f"{at:g}",
            partial(self._measure, lit, size, pixels),
            {
                "voxels": size**3,
                "size": pixels,
                "step_voxels": STEP,
                "kappa_per_mm": KAPPA,
                "threads": 1,
                "series": "ART",
                "grows_with": sweep,
                "amount": at,
            },
        )

    def _measure(self, lit: bool, size: int, pixels: int) -> Measured:
        volume = shells(size)
        quality = Quality(STEP, 1 / 1024, compact=True)
        tracer = ActiveRayTracer(shell_scene(volume, lit=lit), quality, threads=1)
        camera = shell_camera(pixels)
        timing, _ = measure(lambda: tracer.render(camera), budget_s=self._budget_s)
        assert tracer.report is not None
        counters = {key: float(n) for key, n in tracer.report.counters.items()}
        counters["bytes_per_voxel"] = tracer.memory / volume.values.size
        return Measured(timing, counters=counters)
