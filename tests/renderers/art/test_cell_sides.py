"""Memory of a lit volume's copy, by the side of its cells."""

import numpy as np
import pytest

from renderers.art import ActiveRayTracer
from renderers.art.cell_sides import LIT_BYTES, SIDES, brick_voxels, leanest_side
from renderers.scene import (
    Camera,
    Projection,
    Scene,
    TransferFunction,
    Volume,
    four_lights,
)


@pytest.mark.parametrize("shape", [(64, 64, 64), (128, 96, 160), (97, 189, 143)])
def test_the_leanest_cells_take_at_most_what_others_take(
    shape: tuple[int, int, int],
) -> None:
    """Eight bytes a voxel of a lit brick; whole cells of 32 keep below nine of them."""

    def a_voxel(side: int) -> float:
        return float(LIT_BYTES * brick_voxels(shape, side) / np.prod(shape))

    best = a_voxel(leanest_side(shape))
    assert best == min(a_voxel(side) for side in SIDES)
    if all(n % 32 == 0 for n in shape):
        # and one more for the distance over empty space
        assert best + 1 <= 10


def test_a_large_lit_copy_keeps_to_ten_bytes_a_voxel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every cell is met: all of the volume is thin tissue."""
    monkeypatch.setattr("renderers.art.cell_sides.ROOMY_BYTES", 1 << 20)
    rng = np.random.default_rng(3)
    values = rng.integers(1, 900, (64, 64, 64)).astype(np.int16)
    volume = Volume(values, np.full(3, 0.3), np.full(3, -9.5))
    transfer = TransferFunction(
        np.array([0.0, 1000.0]), np.ones((2, 3)), np.array([1e-3, 2e-3])
    )
    scene = Scene(volume, transfer, four_lights())
    camera = Camera.looking_at(
        (40.0, 30, 20),
        (0.0, 0, 0),
        extent=0.3,
        size=(48, 48),
        projection=Projection.PERSPECTIVE,
    )
    tracer = ActiveRayTracer(scene, "snapshot", threads=1)
    found = tracer.render(camera)
    assert tracer.report is not None
    assert tracer.report.counters["cells_fetched"] == 8
    # one brick is to spare, for cells in which nothing can be seen
    spare = LIT_BYTES * 33**3
    assert (tracer.memory - spare) / values.size <= 10
    monkeypatch.undo()
    small = ActiveRayTracer(scene, "snapshot", threads=1)
    assert small.render(camera).rgba.tobytes() == found.rgba.tobytes()
    assert small.memory / values.size > 12
