"""Volumes at the edges of what a ray caster can be given."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

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

PLAIN = PhongMaterial(1, 0, 0)
SHAPE = (12, 15, 13)
FINE = Quality(0.25, 0.0)
COMPACT = Quality(0.25, 0.0, compact=True)
RAMP = TransferFunction(
    np.array([40.0, 200.0]),
    np.array([[0.1, 0.5, 0.9], [0.9, 0.4, 0.1]]),
    np.array([0.0, 0.4]),
)


def speckle() -> NDArray[np.uint8]:
    return np.random.default_rng(4).integers(0, 256, SHAPE).astype(np.uint8)


def volume_of(values: NDArray[np.generic]) -> Volume:
    return Volume(values, np.array([0.9, 1.0, 1.1]), np.array([-6.0, -7, -6]))


def from_corner(size: int = 12) -> Camera:
    return Camera.looking_at(
        [-20.0, -30, 14], [0.0, 0, 0], extent=0.3, size=(size, size),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip


def drawn(
    values: NDArray[np.generic], quality: Quality, *, lit: bool = False
) -> NDArray[np.float32]:
    lights, material = (four_lights(), PhongMaterial()) if lit else ((), PLAIN)
    scene = Scene(volume_of(values), RAMP, lights, material)
    return ActiveRayTracer(scene, quality, threads=1).render(from_corner()).rgba


@pytest.mark.parametrize("lit", [False, True])
@pytest.mark.parametrize(
    "kind", ["<i2", ">i2", "<u2", ">u4", "<i8", "<f4", ">f4", "<f8", ">f8"]
)
def test_a_type_of_number_changes_no_bit(kind: str, lit: bool) -> None:
    expected = drawn(speckle(), FINE, lit=lit)
    assert expected[..., 3].max() > 0.5
    values = speckle().astype(np.dtype(kind))
    assert drawn(values, FINE, lit=lit).tobytes() == expected.tobytes()


@pytest.mark.slow
def test_neither_does_the_way_it_lies_in_memory() -> None:
    expected = drawn(speckle(), COMPACT).tobytes()
    values = speckle().astype(np.int16)
    wide = np.zeros((SHAPE[0], 2 * SHAPE[1], 3 * SHAPE[2]), np.int16)
    wide[:, ::2, ::3] = values
    fixed = values.copy()
    fixed.flags.writeable = False
    backwards = np.ascontiguousarray(values[::-1])[::-1]
    for same in (np.asfortranarray(values), wide[:, ::2, ::3], fixed, backwards):
        assert drawn(same, COMPACT).tobytes() == expected


@pytest.mark.parametrize("lit", [False, True])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused(bad: float, lit: bool) -> None:
    values = speckle().astype(np.float32)
    values[3, 4, 5] = bad
    with pytest.raises(ValueError, match="not finite; replace them"):
        drawn(values, FINE, lit=lit)


@pytest.mark.parametrize("end", [-32768, 32767])
def test_the_ends_of_whole_numbers_do_not_wrap(end: int) -> None:
    """Beside the smallest and the largest int16, each way of keeping them agrees."""
    values = speckle().astype(np.int16)
    values[6, 7, 6] = end
    error = drawn(values, COMPACT).astype(np.float64) - drawn(values, FINE)
    # Places along y are rounded to 1/32767 voxel: a unit between such neighbours.
    assert np.abs(error).max() < 2e-3
    wide = drawn(values.astype(np.int32), FINE)
    assert wide.tobytes() == drawn(values, FINE).tobytes()


def through(scene: Scene, size: int = 3) -> tuple[NDArray[np.float32], dict[str, int]]:
    camera = Camera.looking_at(
        scene.volume.center_mm - [0, 40.0, 0], scene.volume.center_mm, extent=0.05,
        size=(size, size), projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    tracer = ActiveRayTracer(scene, FINE, threads=1)
    rgba = tracer.render(camera).rgba
    assert tracer.report is not None
    return rgba, tracer.report.counters


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_two_voxels_are_a_slab(axis: int) -> None:
    shape = tuple(2 if k == axis else 9 for k in range(3))
    volume = Volume(np.full(shape, 200, np.int16), np.full(3, 0.5), np.zeros(3))
    scene = Scene(volume, RAMP, (), PLAIN)
    rgba, _ = through(scene)
    length = 0.5 * (shape[1] - 1)
    assert rgba[..., 3] == pytest.approx(-math.expm1(-0.4 * length), abs=1e-6)


def test_a_medium_without_slope_is_not_shaded() -> None:
    """Four lights and highlights, and no normal to light: its own colour."""
    volume = volume_of(np.full(SHAPE, 200, np.int16))
    lit, _ = through(Scene(volume, RAMP, four_lights()))
    flat, _ = through(Scene(volume, RAMP, (), PLAIN))
    assert np.array_equal(lit, flat)


@pytest.mark.parametrize("scale", [1e-4, 1e3])
def test_pictures_do_not_depend_on_the_unit(scale: float) -> None:
    """A thousandth of a millimetre or ten metres, extinction in proportion."""
    pictures = []
    for k in (1.0, scale):
        base = volume_of(speckle())
        volume = Volume(base.values, k * base.spacing_mm, k * base.origin_mm)
        transfer = TransferFunction(RAMP.nodes, RAMP.color, RAMP.kappa_per_mm / k)
        camera = Camera.looking_at(
            k * np.array([-20.0, -30, 14]), np.zeros(3), extent=0.3, size=(12, 12),
            projection=Projection.PERSPECTIVE,
        )  # fmt: skip
        tracer = ActiveRayTracer(Scene(volume, transfer, (), PLAIN), FINE, threads=1)
        pictures.append(tracer.render(camera).rgba)
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-5


@pytest.mark.parametrize("lit", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_volume_on_disk_is_drawn_cell_by_cell(tmp_path: Path, lit: bool) -> None:
    """A mapped file and room for five cells: the bits of a volume in memory."""
    shape = (20, 31, 26)
    values = np.random.default_rng(5).integers(0, 256, shape).astype(np.int16)
    path = tmp_path / "volume.npy"
    np.save(path, values)
    mapped = np.load(path, mmap_mode="r", allow_pickle=False)
    assert isinstance(mapped, np.memmap)
    lights, material = (four_lights(), PhongMaterial()) if lit else ((), PLAIN)
    pictures = []
    for kept, room in ((values, None), (mapped, 5)):
        volume = Volume(kept, np.full(3, 0.7), np.array([-9.0, -10, -7]))
        scene = Scene(volume, RAMP, lights, material)
        tracer = ActiveRayTracer(scene, COMPACT, threads=2, cache_cells=room)
        pictures.append(tracer.render(from_corner(40)).rgba)
    assert tracer.report is not None
    assert tracer.report.counters["cells_evicted"] > 0
    # Bricks of nine cubed voxels, five and the one that serves all empty cells, and a
    # byte of distance for each cube.
    brick = 9**3 * 2 * (4 if lit else 1)
    assert tracer.memory <= 6 * brick + values.size
    assert pictures[0].tobytes() == pictures[1].tobytes()


@pytest.mark.parametrize("lit", [False, True])
def test_what_there_is_no_room_for_is_made_anew(lit: bool) -> None:
    """To the bits of all the room there is; too little is refused with its bytes."""
    values = np.random.default_rng(5).integers(0, 256, (60, 65, 70)).astype(np.int16)
    lights, material = (four_lights(), PhongMaterial()) if lit else ((), PLAIN)
    volume = Volume(values, np.full(3, 0.25), np.array([-9.0, -8, -7]))
    scene = Scene(volume, RAMP, lights, material)
    brick = 17**3 * 2 * (4 if lit else 1)
    limit = values.size + 68 * brick
    pictures = []
    for allowed in (None, limit):
        tracer = ActiveRayTracer(scene, COMPACT, cell_side=16, memory_bytes=allowed)
        pictures.append(tracer.render(from_corner(40)).rgba)
    if lit:
        assert tracer.report is not None
        assert tracer.report.counters["cells_evicted"] > 0
    assert tracer.memory <= limit
    assert pictures[0].tobytes() == pictures[1].tobytes()
    for allowed, complaint in (
        (values.size + 30 * brick, r"70 x 65 x 60 voxels needs at least [\d,]+ bytes"),
        (1000, r"needs 273,000 bytes .* at most 1,000 may"),
    ):
        tracer = ActiveRayTracer(scene, COMPACT, cell_side=16, memory_bytes=allowed)
        with pytest.raises(ValueError, match=complaint):
            tracer.render(from_corner())


def test_a_copy_that_no_memory_holds_is_refused_before_it_is_made() -> None:
    endless = np.broadcast_to(np.int16(0), (30_000, 30_000, 30_000))
    with pytest.raises(ValueError, match=r"54,000,000,000,000 bytes in C order"):
        Volume(endless, np.ones(3), np.zeros(3))


@pytest.mark.parametrize("between", [False, True])
def test_an_array_edited_while_it_is_drawn_is_refused(between: bool) -> None:
    """During a picture or between two: none is made of two volumes."""
    values = np.random.default_rng(5).integers(0, 256, (40, 41, 42)).astype(np.int16)
    volume = Volume(values, np.full(3, 0.4), np.full(3, -8.0))
    thin = TransferFunction(RAMP.nodes, RAMP.color, 0.01 * RAMP.kappa_per_mm)
    scene = Scene(volume, thin, four_lights())
    # the room for one cell: each is made anew again and again
    tracer = ActiveRayTracer(scene, COMPACT, threads=1, cache_cells=1)
    wanted = tracer.render(from_corner(40)).rgba
    tracer = ActiveRayTracer(scene, COMPACT, threads=1, cache_cells=1)

    def edit(share: float) -> bool:
        values[:] = 0
        return True

    if between:
        assert tracer.render(from_corner(40)).rgba.tobytes() == wanted.tobytes()
        edit(1.0)
    with pytest.raises(ValueError, match="array was edited while it was drawn"):
        tracer.render(from_corner(40), edit)


def test_spacings_of_two_units_are_refused() -> None:
    with pytest.raises(ValueError, match="ratio beyond 10000; one of the numbers is"):
        Volume(speckle(), np.array([1.0, 1.0, 1.1e4]), np.zeros(3))
    Volume(speckle(), np.array([1.0, 1.0, 1e4]), np.zeros(3))
