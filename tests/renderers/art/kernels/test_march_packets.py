"""The compiled marches against the same steps in plain Python, sample by sample.

And packets of any width, of one ray or of many, draw the same, bit by bit.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.kernels.find_surface import BISECTIONS
from renderers.art.march import FrameRays
from renderers.art.quality import ClassificationName
from renderers.art.ranks.prepare import make_node
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import Region
from renderers.reference import sobel_gradient
from renderers.scene import Camera, PhongMaterial, Scene, TransferFunction, Volume
from tests.slow_cases import slow

WHOLE = Region(0, 0, 8, 7)
F = np.float32

QUALITIES = (
    Quality(0.5, 1 / 1024),
    Quality(0.7, 0.02, renormalise=True),
    Quality(1.0, 0.0, skip_empty=False),
    Quality(0.5, 1 / 255, compact=True),
)


def fields(volume: Volume) -> NDArray[np.float32]:
    """Stack the value and the gradient along the array's axes, (nz, ny, nx, 4)."""
    gradient = sobel_gradient(volume) @ volume.direction
    values = volume.values.astype(np.float64)[..., None]
    return np.concatenate([values, gradient], axis=-1).astype(np.float32)


def at(field: NDArray[np.float32], point: NDArray[np.float32]) -> NDArray[np.float32]:
    """Interpolate along x, then y, then z, in float32 as the kernel does."""
    top = np.array(field.shape[2::-1]) - 2
    i, j, k = np.clip(point.astype(int), 0, top)
    fx, fy, fz = point - np.array([i, j, k], np.float32)
    cube = field[k : k + 2, j : j + 2, i : i + 2]
    lines = cube[:, :, 0] + fx * (cube[:, :, 1] - cube[:, :, 0])
    faces = lines[:, 0] + fy * (lines[:, 1] - lines[:, 0])
    result: NDArray[np.float32] = faces[0] + fz * (faces[1] - faces[0])
    return result


def trace(scene: Scene, mode: str, camera: Camera) -> tuple[RayPacket, RayPacket]:
    """Give rays before and after the compiled march."""
    march, node, _ = make_node(scene, mode, Quality(0.5, 1 / 255, skip_empty=False))
    rays = FrameRays.of(camera)
    before, packet = march.start(WHOLE, rays), march.start(WHOLE, rays)
    node.begin(1, [packet])
    while not node.is_finished:
        node.advance(1)
    return before, packet


def test_classic_against_plain_python(scene: Scene, outside: Camera) -> None:
    before, packet = trace(scene, "classic", outside.with_size(8, 7))
    field = fields(scene.volume)
    spacing = scene.volume.spacing_mm
    material = scene.material
    axes = scene.volume.direction
    for ray in range(WHOLE.pixels):
        geometry = before.geometry[ray]
        color, clear = np.zeros(3), 1.0
        for i in range(before.count[ray]):
            point = geometry[:3] + F(i) * geometry[3:6]
            v, *g = at(field, point).astype(float)
            radiance, kappa = scene.transfer_function.evaluate(np.array([v]))
            if kappa[0] == 0:
                continue
            view = geometry[3:6] * spacing / geometry[6]
            normal = -np.array(g) / np.linalg.norm(g)
            diffuse, glint = np.full(3, material.ambient), np.zeros(3)
            for light in scene.lights:
                to = axes.T @ light.vector
                if light.is_local:
                    to = axes.T @ (light.vector - scene.volume.origin_mm)
                    to = to - point * spacing
                    to /= np.linalg.norm(to)
                half = (to - view) / np.linalg.norm(to - view)
                diffuse += material.diffuse * max(normal @ to, 0) * light.color
                power = max(normal @ half, 0) ** material.shininess
                glint += material.specular * power * light.color
            weight = clear * -math.expm1(-kappa[0] * geometry[6])
            color += weight * (radiance[0] * diffuse + glint)
            clear -= weight
            if clear < 1 / 255:
                break
        assert packet.result[ray] == pytest.approx([*color, 1 - clear], abs=2e-5)


def test_scope_against_plain_python(scene: Scene, inside: Camera) -> None:
    before, packet = trace(scene, "scope", inside.with_size(8, 7))
    assert scene.surface is not None
    field = fields(scene.surface.distance)
    hits = 0
    for ray in range(WHOLE.pixels):
        geometry = before.geometry[ray]

        def value(i: float, g: NDArray[np.float32] = geometry) -> NDArray[np.float32]:
            return at(field, g[:3] + F(i) * g[3:6])

        found = next((i for i in range(before.count[ray]) if value(i)[0] >= 0), None)
        if found is None:
            assert packet.depth[ray] == np.inf
            assert not packet.value[ray].any()
            continue
        hits += 1
        low, high = found - 1.0, float(found)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            low, high = (low, middle) if value(middle)[0] >= 0 else (middle, high)
        v, *slope = value(high).astype(float)
        g = np.array(slope)
        rise = g @ (geometry[3:6] * scene.surface.distance.spacing_mm)
        back = min(v / rise, 1 / 2**BISECTIONS) if rise > 0 else 0.0
        depth = geometry[7] + F(high - back) * geometry[6]
        assert packet.depth[ray] == pytest.approx(depth, rel=1e-6)
        assert packet.value[ray] == pytest.approx(
            [*(-g / np.linalg.norm(g)), 1], abs=1e-5
        )
    assert hits > 20


def picture(
    scene: Scene, camera: Camera, quality: Quality, packet: int, cells: int
) -> tuple[bytes, dict[str, int]]:
    tracer = ActiveRayTracer(
        scene, quality, threads=1, cache_cells=cells, validate=True, packet=packet
    )
    image = tracer.render(camera)
    assert image.depth_mm is not None
    assert tracer.report is not None
    return image.rgba.tobytes() + image.depth_mm.tobytes(), tracer.report.counters


@pytest.mark.parametrize("width", [4, *slow(8, 16, 64)])
@pytest.mark.parametrize("quality", QUALITIES)
def test_any_width_gives_the_same_bits(
    scene: Scene, outside: Camera, quality: Quality, width: int
) -> None:
    """Local and distant lights, highlights, jumps in extinction, odd sizes."""
    for camera in (outside, outside.with_size(7, 50)):
        expected, before = picture(scene, camera, quality, 32, 999)
        found, after = picture(scene, camera, quality, width, 999)
        assert found == expected
        for counter in ("samples", "contributing", "skipped"):
            assert after[counter] == before[counter]


@pytest.mark.parametrize("cells", [1, 5])
def test_rays_that_miss_cells_go_on_later(
    scene: Scene, outside: Camera, cells: int
) -> None:
    expected, _ = picture(scene, outside, QUALITIES[0], 32, 999)
    found, counters = picture(scene, outside, QUALITIES[0], 32, cells)
    assert found == expected
    assert counters["cells_evicted"] > 0


@pytest.mark.parametrize("quality", [QUALITIES[0], QUALITIES[3]])
def test_a_scene_without_lights_keeps_its_colours(
    scene: Scene, outside: Camera, quality: Quality
) -> None:
    """From the whole volume and from cells that come and go; with gradients, too."""
    bare = Scene(scene.volume, scene.transfer_function, (), PhongMaterial(1, 0, 0))
    expected, _ = picture(bare, outside, quality, 32, 999)
    assert np.frombuffer(expected, np.float32).max() > 0
    whole, counters = picture(bare, outside, quality, 32, 999)
    assert counters["cells_fetched"] == 0
    bricks, counters = picture(bare, outside, quality, 32, 5)
    assert counters["cells_evicted"] > 0
    assert whole == bricks == expected
    # Light that gives nothing back is left out, and so little of it does not show
    # although it asks how each wall is turned.
    for diffuse, is_left_out in ((0.0, True), (1e-30, False)):
        material = PhongMaterial(1, diffuse, 0)
        lit = Scene(bare.volume, bare.transfer_function, scene.lights[:1], material)
        found, counters = picture(lit, outside, quality, 32, 999)
        assert (counters["cells_fetched"] == 0) == is_left_out
        assert found == expected


@pytest.mark.parametrize("classification", ["post", "integrated"])
def test_rays_that_outlive_their_packet_go_on_together(
    scene: Scene, outside: Camera, classification: ClassificationName
) -> None:
    """Ends at random, and few of them far away, so that packets leave rays again."""
    camera = outside.with_size(96, 40)
    random = np.random.default_rng(11)
    limit = random.choice([30.0, 34.0, 38.0, 60.0], (40, 96)).astype(np.float32)
    quality = Quality(0.25, 0.0, classification=classification)
    found = []
    for packet in (4, 32):
        for cells in (999, 40):
            tracer = ActiveRayTracer(
                scene, quality, threads=1, cache_cells=cells, packet=packet
            )
            image = tracer.render(camera, limit_mm=limit)
            assert image.depth_mm is not None
            assert np.isfinite(image.depth_mm).any()
            found.append(image.rgba.tobytes() + image.depth_mm.tobytes())
    assert len(set(found)) == 1


@pytest.mark.parametrize("mode", ["post", "integrated", "scope"])
def test_a_ray_alone_sees_what_it_sees_among_others(
    scene: Scene, outside: Camera, inside: Camera, mode: str
) -> None:
    """All others end before they begin: of every packet one lane has a ray."""
    camera = inside if mode == "scope" else outside
    kind: ClassificationName = "integrated" if mode == "integrated" else "post"
    tracer = ActiveRayTracer(
        scene, Quality(0.5, 1 / 1024, classification=kind), threads=1, packet=32
    )

    def drawn(limit: NDArray[np.float32] | None) -> NDArray[np.float32]:
        if mode == "scope":
            buffer = tracer.gbuffer(camera, limit_mm=limit)
            return np.dstack([buffer.normal, buffer.depth_mm])
        return tracer.render(camera, limit_mm=limit).rgba

    among = drawn(None)
    rows, columns = np.divmod(np.arange(0, 43 * 50, 211), 50)
    assert np.unique(among[rows, columns], axis=0).shape[0] > 4
    for row, column in zip(rows, columns, strict=True):
        limit = np.zeros((43, 50), np.float32)
        limit[row, column] = np.inf
        alone = drawn(limit)[row, column]
        assert alone.tobytes() == among[row, column].tobytes()


SEGMENTS_QUALITIES = (
    Quality(0.5, 1 / 1024, classification="integrated"),
    Quality(1.0, 0.02, renormalise=True, compact=True, classification="integrated"),
    Quality(3.3, 0.0, classification="integrated"),
)
SHELLS = TransferFunction(
    np.array([-400.0, -100, -99.5, -99, 50, 60, 70, 71, 71.001, 72, 300]),
    np.random.default_rng(8).random((11, 3)),
    np.array([0.0, 0, 40, 0, 0, 2, 0, 0, 9, 0, 0]),
)
"""Shells thinner than a step, with what is clear before, between and behind them."""


def picture_segments(
    scene: Scene,
    camera: Camera,
    quality: Quality,
    packet: int,
    cells: int | None = None,
    side: int = 8,
) -> tuple[bytes, dict[str, int]]:
    tracer = ActiveRayTracer(
        scene, quality, threads=1, cell_side=side, cache_cells=cells, validate=True,
        packet=packet,
    )  # fmt: skip
    image = tracer.render(camera)
    assert image.depth_mm is not None
    assert tracer.report is not None
    return image.rgba.tobytes() + image.depth_mm.tobytes(), tracer.report.counters


@pytest.fixture(scope="module", params=["lit", "unlit", "shells", "unlit shells"])
def subject(scene: Scene, request: pytest.FixtureRequest) -> Scene:
    """Get the small scene in four dresses."""
    if "shells" in request.param:
        scene = replace(scene, transfer_function=SHELLS)
    if "unlit" in request.param:
        scene = replace(scene, lights=(), material=PhongMaterial(1, 0, 0))
    return scene


@pytest.mark.parametrize("width", [4, *slow(8, 16, 64)])
@pytest.mark.parametrize(
    "quality",
    [
        SEGMENTS_QUALITIES[0],
        # samples in whole numbers compile all the kernels once more
        pytest.param(SEGMENTS_QUALITIES[1], marks=pytest.mark.slow),
        SEGMENTS_QUALITIES[2],
    ],
)
def test_any_width_gives_the_same_bits_segments(
    subject: Scene, outside: Camera, quality: Quality, width: int
) -> None:
    expected, before = picture_segments(subject, outside, quality, 32)
    found, after = picture_segments(subject, outside, quality, width)
    assert found == expected
    assert before["contributing"] > 0
    for counter in ("samples", "contributing", "skipped"):
        assert after[counter] == before[counter]


@pytest.mark.parametrize("quality", SEGMENTS_QUALITIES)
def test_skipping_cells_and_their_coming_change_no_bit(
    subject: Scene, outside: Camera, quality: Quality
) -> None:
    """Rays stop within a step of what they meet, and go on from there."""
    expected, on = picture_segments(subject, outside, quality, 32)
    full = replace(quality, skip_empty=False)
    found, off = picture_segments(subject, outside, full, 32)
    assert found == expected
    assert on["samples"] + on["skipped"] == off["samples"]
    assert on["contributing"] == off["contributing"]
    for side, cells in itertools.product((8, 16), (1, 3, 5)):
        found, after = picture_segments(subject, outside, quality, 32, cells, side)
        assert found == expected
        assert after["cells_evicted"] > 0 or side == 16


def test_volumes_too_large_for_distances_are_drawn_alike(
    subject: Scene, outside: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Empty cells all show one value then, and it belongs to what is clear there."""
    expected, _ = picture_segments(subject, outside, SEGMENTS_QUALITIES[0], 32)
    monkeypatch.setattr("renderers.art.ranks.scene_look.LARGEST_LEAP", 1)
    found, counters = picture_segments(subject, outside, SEGMENTS_QUALITIES[0], 32)
    assert found == expected
    assert counters["skipped"] == 0
    found, _ = picture_segments(subject, outside, SEGMENTS_QUALITIES[0], 32, 5)
    assert found == expected


@pytest.mark.parametrize("step", [0.25, 0.5, 0.84, 0.998])
def test_between_shells_rays_leap_over_what_is_clear(
    scene: Scene, outside: Camera, step: float
) -> None:
    """Noise: cubes of either interval lie as near to each other as they can.

    To the bits of the march that leaps over nothing; and over both intervals, which
    are half of the volume each.
    """
    rng = np.random.default_rng(11)
    values = np.repeat(rng.choice([-300, 300], (12, 12, 12)), 3, axis=0)
    values = np.repeat(np.repeat(values, 3, axis=1), 3, axis=2)
    values += rng.integers(-200, 200, values.shape)
    volume = Volume(
        values.astype(np.int16), np.full(3, 0.5), scene.volume.center_mm - 8.75
    )
    film = TransferFunction(
        np.array([-20.0, 0, 20]), rng.random((3, 3)), np.array([0.0, 3, 0])
    )
    scene = Scene(volume, film, (), PhongMaterial(1, 0, 0))
    quality = Quality(step, 0.0, classification="integrated")
    found, on = picture_segments(scene, outside, quality, 32)
    everywhere = replace(quality, skip_empty=False)
    expected, off = picture_segments(scene, outside, everywhere, 32)
    assert found == expected
    assert on["contributing"] == off["contributing"] > 0
    assert on["samples"] + on["skipped"] == off["samples"]
    either = film.kappa_per_mm * 0
    either[1:] = 1e-3
    one = replace(scene, transfer_function=replace(film, kappa_per_mm=either))
    _, lone = picture_segments(one, outside, quality, 32)
    assert on["samples"] < 0.9 * lone["samples"]
