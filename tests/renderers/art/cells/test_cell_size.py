"""Memory of a lit volume's copy, by the side of its cells."""

import numpy as np
import pytest

from renderers.art import ActiveRayTracer
from renderers.art.cells.cell_size import (
    LIT_BYTES,
    MOST_A_VOXEL,
    QUICK_SIDE,
    SIDES,
    brick_voxels,
    leanest_side,
    side_for,
)
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


def test_quick_cells_are_taken_where_they_keep_to_the_bound() -> None:
    shape = (256, 256, 256)
    assert side_for(shape, 0) == side_for(shape, 3600) == QUICK_SIDE
    assert side_for(shape, 16**3) == leanest_side(shape) == 32


@pytest.mark.parametrize(("filled", "side"), [(False, QUICK_SIDE), (True, 32)])
def test_a_lit_copy_keeps_to_ten_bytes_a_voxel(filled: bool, side: int) -> None:
    """Thin tissue everywhere, or in the lower half; to the bits of other cells."""
    rng = np.random.default_rng(3)
    values = rng.integers(1, 900, (64, 64, 64)).astype(np.int16)
    if not filled:
        values[32:] = -10
    volume = Volume(values, np.full(3, 0.3), np.full(3, -9.5))
    transfer = TransferFunction(
        np.array([0.0, 1000.0]), np.ones((2, 3)), np.array([1e-3 * filled, 2e-3])
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
    assert tracer.report.counters["cells"] == (64 // side) ** 3
    # one brick is to spare, for cells in which nothing can be seen
    spare = LIT_BYTES * (side + 1) ** 3
    assert (tracer.memory - spare) / values.size <= MOST_A_VOXEL
    small = ActiveRayTracer(scene, "snapshot", threads=1, cell_side=8)
    assert small.render(camera).rgba.tobytes() == found.rgba.tobytes()
    if filled:
        assert small.memory / values.size > 12
