"""Rays that run where rounding decides: along faces, through corners, just outside."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
    four_lights,
)

N = 33
"""Voxels an axis: four cells of eight cubes, 32 mm."""

KAPPA = 0.05
TISSUE = TransferFunction(
    np.array([-1.0, 1.0]), np.full((2, 3), 0.5), np.full(2, KAPPA)
)
QUALITY = Quality(0.5, 0.0)
BOTH = pytest.mark.parametrize(
    "kind", ["integrated", pytest.param("post", marks=pytest.mark.slow)]
)


def cube(side: int = 8, kind: ClassificationName = "post") -> ActiveRayTracer:
    """Fill 0 to 32 mm; lit, so that rays go from cell to cell."""
    volume = Volume(np.zeros((N, N, N), np.int16), np.ones(3), np.zeros(3))
    scene = Scene(volume, TISSUE, (), PhongMaterial(0.999999, 0, 0))
    quality = replace(QUALITY, classification=kind)
    return ActiveRayTracer(scene, quality, threads=1, cell_side=side)


def one(
    tracer: ActiveRayTracer, eye: NDArray[np.float64], way: NDArray[np.float64]
) -> float:
    camera = Camera.looking_at(
        eye, eye + way, up=(0.0, 1.0, 0.0) if abs(way[2]) > 0.9 else (0.0, 0.0, 1.0),
        extent=1e-9, size=(1, 1), projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    return float(tracer.render(camera).rgba[0, 0, 3])


def depth_of(alpha: float) -> float:
    return -math.log1p(-alpha) / KAPPA


AXES = [sign * row for row in np.eye(3) for sign in (1.0, -1.0)]


@BOTH
@pytest.mark.parametrize("at", [0.0, -0.0, 8.0, 16.5, 32.0])
@pytest.mark.parametrize("way", AXES)
def test_rays_along_an_axis_and_in_a_face(
    way: NDArray[np.float64], at: float, kind: ClassificationName
) -> None:
    """On the volume's lowest and highest face, between cells, and within one."""
    eye = np.where(way != 0, np.where(way > 0, -10.0, 42.0), at)
    assert depth_of(one(cube(kind=kind), eye, way)) == pytest.approx(32, abs=1e-4)


@pytest.mark.parametrize("way", AXES)
def test_rays_just_outside_meet_nothing(way: NDArray[np.float64]) -> None:
    for at in (-1e-6, np.nextafter(32, 99) + 1e-12):
        eye = np.where(way != 0, np.where(way > 0, -10.0, 42.0), at)
        assert one(cube(), eye, way) == 0


@BOTH
@pytest.mark.parametrize("side", [8, 16])
def test_rays_through_corners_of_cells(side: int, kind: ClassificationName) -> None:
    """The diagonal and edges: each sample in one cell, the length the chord's."""
    ways = ([1.0, 1, 1], [1.0, 1, -1], [1.0, 1, 0], [0.0, 1, 1], [1.0, 0, -1])
    for way in map(np.array, ways):
        tracer = cube(side, kind)
        middle = np.array([16.0, 16, 16])
        eye = middle - 30 * way / np.linalg.norm(way) * math.sqrt(3)
        found = depth_of(one(tracer, eye, way))
        assert found == pytest.approx(32 * np.linalg.norm(way), abs=2e-4)
        assert tracer.report is not None
        counters = tracer.report.counters
        ends = int(kind == "integrated")
        assert counters["samples"] == math.ceil(np.linalg.norm(way) * 64) + ends
        assert counters["cells_fetched"] <= 3 * 32 // side


@BOTH
@pytest.mark.parametrize("angle", [1e-7, 1e-5, 1e-3])
def test_rays_that_graze_a_face(angle: float, kind: ClassificationName) -> None:
    """Just inside they have the whole length, turned away none of it."""
    for inwards in (1.0, -1.0):
        way = np.array([0.0, math.cos(angle), inwards * math.sin(angle)])
        found = one(cube(kind=kind), np.array([16.0, 0.0, 0.0]), way)
        wanted = 32 / math.cos(angle) if inwards > 0 else 0.0
        assert depth_of(found) == pytest.approx(wanted, abs=1e-3)


def test_a_ray_that_touches_a_corner_meets_nothing() -> None:
    way = np.array([1.0, -1.0, 0.0])
    for shift in (0.0, 1e-9):
        eye = np.array([-10.0 - shift, 10.0 - shift, 16.0])
        assert one(cube(), eye, way) < 1e-6


@pytest.mark.parametrize("place", [(16.0, 16, 16), (16.0, 8, 16.5), (0.0, 16, 16)])
def test_an_eye_on_a_voxel_a_face_or_the_boundary_sees_no_seam(
    place: tuple[float, float, float],
) -> None:
    """A millionth of a millimetre aside changes the picture by nothing seen."""
    volume = Volume(
        np.random.default_rng(2).integers(-1, 2, (N, N, N)).astype(np.int16),
        np.ones(3),
        np.zeros(3),
    )
    ramp = TransferFunction(np.array([-1.0, 1.0]), np.eye(3)[:2], np.array([0.0, 0.2]))
    tracer = ActiveRayTracer(Scene(volume, ramp), QUALITY, threads=1)
    pictures = []
    for aside in (0.0, 1e-6, -1e-6):
        eye = np.array(place) + aside
        camera = Camera.looking_at(
            eye, eye + np.array([1.0, 2.0, 0.5]), extent=0.7, size=(20, 20),
            projection=Projection.PERSPECTIVE,
        )  # fmt: skip
        pictures.append(tracer.render(camera).rgba.astype(np.float64))
    assert np.isfinite(pictures[0]).all()
    for moved in pictures[1:]:
        assert np.sqrt(np.mean((moved - pictures[0]) ** 2)) < 1e-4


def test_an_eye_within_the_opaque_sees_its_colour() -> None:
    volume = Volume(np.zeros((N, N, N), np.int16), np.ones(3), np.zeros(3))
    opaque = TransferFunction(TISSUE.nodes, TISSUE.color, np.full(2, 1e4))
    tracer = ActiveRayTracer(Scene(volume, opaque), QUALITY, threads=1)
    camera = Camera.looking_at([9.3, 8, 7.1], [20.0, 20, 20], size=(8, 8))
    rgba = tracer.render(camera).rgba
    seen = np.linalg.norm(camera.rays()[1], axis=-1) > 0.5
    assert (rgba[seen] == [0.5, 0.5, 0.5, 1]).all()
    assert not rgba[~seen].any()


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1), (65, 3)])
def test_pictures_of_odd_sizes_are_parts_of_one_law(size: tuple[int, int]) -> None:
    camera = Camera.looking_at(
        [16.0, -40, 16], [16.0, 16, 16], extent=0.2, size=size,
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    rgba = cube().render(camera).rgba
    origins, directions = camera.rays()
    cosine = directions[..., 1]
    points = origins + directions * (72 / cosine)[..., None]
    inside = np.all((points[..., ::2] > 0) & (points[..., ::2] < 32), axis=-1)
    depth = -np.log1p(-rgba[..., 3].astype(np.float64)) / KAPPA
    assert inside.any()
    assert depth[inside] == pytest.approx((32 / cosine)[inside], abs=1e-3)


@BOTH
@pytest.mark.parametrize("place", [1e-6, 0.3, 8.0, 31.999, 32 - 1e-6])
def test_there_is_no_near_plane(place: float, kind: ClassificationName) -> None:
    """From any place within, all that lies before the eye is seen, and no more."""
    found = one(cube(kind=kind), np.array([16.0, place, 16]), np.array([0.0, 1, 0]))
    assert found == pytest.approx(-math.expm1(-KAPPA * (32 - place)), abs=1e-6)


def test_half_the_world_is_too_much_for_a_pinhole() -> None:
    with pytest.raises(ValueError, match=r"at most 1\.5533 radians, got 1\.57"):
        Camera.looking_at(
            np.zeros(3), [0, 1.0, 0], extent=math.pi / 2, size=(8, 8),
            projection=Projection.PERSPECTIVE,
        )  # fmt: skip
    Camera.looking_at(np.zeros(3), [0, 1.0, 0], extent=math.pi / 2, size=(8, 8))


@pytest.mark.parametrize("extent", [1e-9, math.radians(89.0)])
def test_the_narrowest_and_the_widest_field_are_finite(extent: float) -> None:
    camera = Camera.looking_at(
        [16.0, -10, 16], [16.0, 16, 16], extent=extent, size=(9, 9),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    rgba = cube().render(camera).rgba
    assert np.isfinite(rgba).all()
    assert rgba[4, 4, 3] == pytest.approx(-math.expm1(-KAPPA * 32), abs=1e-5)


@BOTH
@pytest.mark.parametrize("component", [1e-310, 5e-324, -1e-310, 1e-30])
def test_a_direction_that_all_but_vanishes_along_an_axis_is_none(
    component: float, kind: ClassificationName
) -> None:
    way = np.array([component, 1.0, component])
    alpha = one(cube(kind=kind), np.array([16.0, -10.0, 16.0]), way)
    assert depth_of(alpha) == pytest.approx(32, abs=1e-4)


@BOTH
@pytest.mark.parametrize("offset_mm", [1e6, -1e6])
def test_far_from_the_origin_pictures_are_the_same(
    offset_mm: float, kind: ClassificationName
) -> None:
    """To the rounding of places in float64: rays are set up in it."""
    eye, target = np.array([16.3, -40.0, 15.1]), np.full(3, 16.0)
    values = np.random.default_rng(2).integers(-1, 2, (N, N, N)).astype(np.int16)
    ramp = TransferFunction(np.array([-1.0, 1.0]), np.eye(3)[:2], np.array([0.0, 0.2]))
    quality = replace(QUALITY, classification=kind)
    pictures = []
    for origin in (np.zeros(3), offset_mm * np.array([1.0, -1.0, 0.5])):
        scene = Scene(Volume(values, np.ones(3), origin), ramp, four_lights())
        camera = Camera.looking_at(
            origin + eye, origin + target, extent=0.3, size=(24, 24),
            projection=Projection.PERSPECTIVE,
        )  # fmt: skip
        pictures.append(ActiveRayTracer(scene, quality, threads=1).render(camera).rgba)
    assert pictures[0][..., 3].max() > 0.5
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-5


@BOTH
@pytest.mark.parametrize("offset", [1e6, -3e7])
@pytest.mark.parametrize("kind_of_number", [np.float32, np.float64, np.int32])
def test_far_from_zero_densities_lose_nothing_but_what_their_numbers_do(
    offset: float, kind_of_number: type, kind: ClassificationName
) -> None:
    """Normals are differences of neighbours, which float32 rounds to 1/16 there."""
    random = np.random.default_rng(2).uniform(-1.0, 1.0, (N, N, N))
    values: NDArray[np.generic] = (20.0 * random + offset).astype(kind_of_number)
    ramp = TransferFunction(
        np.array([-20.0, 5.0, 20.0]), np.eye(3), np.array([0.0, 0.02, 0.2])
    )
    far = replace(ramp, nodes=ramp.nodes + offset)
    camera = Camera.looking_at(
        (40.0, -40.0, 30.0), (16.0, 16.0, 16.0), extent=0.3, size=(24, 24),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    quality = replace(QUALITY, classification=kind)
    pictures = []
    for held, transfer in (
        (values, far), ((values.astype(np.float64) - offset).astype(np.float32), ramp)
    ):  # fmt: skip
        volume = Volume(held, np.ones(3), np.zeros(3), background=float(held.min()))
        scene = Scene(volume, transfer, four_lights())
        tracer = ActiveRayTracer(scene, quality, threads=1)
        pictures.append(tracer.render(camera).rgba)
        # and so it is after an edit
        edited = held.copy()
        edited[8:24, 8:24, 8:24] = held.max()
        tracer.replace(replace(scene, volume=volume.with_values(edited, 0.0)))
        pictures.append(tracer.render(camera).rgba)
    assert pictures[0][..., 3].max() > 0.5
    assert np.abs(pictures[0] - pictures[1]).max() > 0.1
    assert np.abs(pictures[0] - pictures[2]).max() < 1e-5
    assert np.abs(pictures[1] - pictures[3]).max() < 1e-5


@BOTH
def test_a_step_longer_than_the_way_is_one_segment(kind: ClassificationName) -> None:
    """Of its true length: two voxels, half a millimetre apart, and steps of 4."""
    values = np.zeros((9, 2, 9), np.int16)
    volume = Volume(values, np.array([1.0, 0.5, 1.0]), np.zeros(3))
    quality = Quality(4.0, 0.0, classification=kind)
    scene = Scene(volume, TISSUE, (), PhongMaterial(1, 0, 0))
    tracer = ActiveRayTracer(scene, quality, threads=1)
    alpha = one(tracer, np.array([4.0, -3.0, 4.0]), np.array([0.0, 1.0, 0.0]))
    assert alpha == pytest.approx(-math.expm1(-KAPPA * 0.5), abs=1e-7)
    assert tracer.report is not None
    assert tracer.report.counters["samples"] == 1 + (kind == "integrated")


def test_a_picture_that_no_memory_holds_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Before anything is taken, with the bytes: machines differ in what they have."""
    monkeypatch.setattr("renderers.scene.camera.memory_limit", lambda: 1 << 30)
    with pytest.raises(ValueError, match=r"16384 x 16384 pix.* 24,696,061,952 b"):
        Camera.looking_at(np.zeros(3), [0, 1.0, 0], size=(16384, 16384))
    Camera.looking_at(np.zeros(3), [0, 1.0, 0], size=(2048, 2048))
