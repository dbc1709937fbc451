"""Whoever moves the rays, and whatever of the volume is at hand, draws the same."""

import itertools
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.scene import Camera, PhongMaterial, Scene, TransferFunction, Volume
from renderers.scene.deflection import Cut, Deflection, Rotation
from tests.slow_cases import slow

QUALITIES = (
    Quality(0.5, 1 / 1024),
    Quality(0.7, 0.02, renormalise=True),
    Quality(1.0, 0.0, skip_empty=False),
    Quality(0.5, 1 / 255, compact=True),
)
WHOLE_NUMBERS = Quality(
    1.0, 0.02, renormalise=True, compact=True, classification="integrated"
)
MODES = ("classic", "scope")


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


Counters = dict[str, int]


def picture(
    scene: Scene, camera: Camera, quality: Quality, mode: str = "classic", **how: Any
) -> tuple[bytes, Counters]:
    """Draw on one thread, in packets and cells that are given or usual."""
    usual: dict[str, Any] = {"threads": 1, "packet": 32, "cell_side": 8}
    tracer = ActiveRayTracer(scene, quality, validate=True, **(usual | how))
    if mode == "scope":
        found = tracer.gbuffer(camera)
        parts: list[NDArray[Any]] = [found.depth_mm, found.normal, found.coverage]
        parts.append(found.material)
    else:
        image = tracer.render(camera)
        assert image.depth_mm is not None
        parts = [image.rgba, image.depth_mm]
    assert tracer.report is not None
    return b"".join(part.tobytes() for part in parts), tracer.report.counters


SHELLS = TransferFunction(
    np.array([-400.0, -100, -99.5, -99, 50, 60, 70, 71, 71.001, 72, 300]),
    np.random.default_rng(8).random((11, 3)),
    np.array([0.0, 0, 40, 0, 0, 2, 0, 0, 9, 0, 0]),
)
"""Shells thinner than a step, with what is clear before, between and behind them."""


def dressed(scene: Scene, dress: str) -> tuple[Scene, Deflection | None]:
    """Change what the small scene shows, or bend the rays to it."""
    if "shells" in dress:
        scene = replace(scene, transfer_function=SHELLS)
    if "unlit" in dress:
        scene = replace(scene, lights=(), material=PhongMaterial(1, 0, 0))
    center, axis = scene.volume.center_mm, np.array([0.3, 1.0, 0.2])
    bends = {
        "turned": Deflection((Rotation(center, 6.0, axis, -0.6),)),
        "cut": Deflection((Cut(center, 6.0, axis, 1.5),)),
    }
    return scene, bends.get(dress)


INTEGRATED = Quality(0.5, 1 / 1024, classification="integrated")
LONG = Quality(3.3, 0.0, classification="integrated")
SNAPSHOT = Quality.named("snapshot")
DRESSES = ("lit", "unlit", "shells", "unlit shells")
CASES = [
    *(("lit", "classic", quality) for quality in QUALITIES),
    ("lit", "scope", Quality(0.6, 0.0)),
    *((dress, "classic", INTEGRATED) for dress in DRESSES),
    *((dress, "classic", LONG) for dress in DRESSES),
    *((dress, mode, SNAPSHOT) for dress in ("turned", "cut") for mode in MODES),
    # samples in whole numbers compile all the kernels once more
    *slow(*((dress, "classic", WHOLE_NUMBERS) for dress in DRESSES)),
    *slow(("turned", "classic", QUALITIES[0]), ("cut", "classic", QUALITIES[0])),
]
EVERY_CASE = pytest.mark.parametrize(("dress", "mode", "quality"), CASES)


@EVERY_CASE
@pytest.mark.parametrize("width", [4, *slow(8, 16, 64)])
def test_packets_of_any_width_draw_the_same(
    scene: Scene,
    outside: Camera,
    inside: Camera,
    dress: str,
    mode: str,
    quality: Quality,
    width: int,
) -> None:
    """Local and distant lights, highlights, jumps in extinction, odd sizes."""
    scene, deflection = dressed(scene, dress)
    for camera in (outside, inside) if mode == "scope" else (outside,):
        for seen in (camera, camera.with_size(7, 50)):
            draw = partial(picture, scene, seen, quality, mode, deflection=deflection)
            (expected, before), (found, after) = draw(), draw(packet=width)
            assert found == expected
            for counter in ("samples", "contributing", "skipped"):
                assert after[counter] == before[counter]


@EVERY_CASE
def test_threads_cells_cache_and_skipping_do_not_change_a_bit(
    scene: Scene,
    outside: Camera,
    inside: Camera,
    monkeypatch: pytest.MonkeyPatch,
    dress: str,
    mode: str,
    quality: Quality,
) -> None:
    """Nor do volumes too large for distances, whose empty cells are one brick."""
    scene, deflection = dressed(scene, dress)
    camera = inside if mode == "scope" else outside
    draw = partial(picture, scene, camera, mode=mode, deflection=deflection)
    expected, usual = draw(quality)
    for side in (8, 16, 32):
        how: dict[str, Any] = {"cell_side": side, "threads": 3, "packet": None}
        assert draw(quality, **how)[0] == expected
        full = replace(quality, skip_empty=False)
        found, everywhere = draw(full, cell_side=side, threads=2)
        assert found == expected
        assert everywhere["skipped"] == 0
        if mode == "classic" and deflection is None:
            seen = usual["samples"] + usual["skipped"]
            assert everywhere["samples"] == seen
            assert usual["skipped"] > 0 or not quality.skip_empty
            assert everywhere["contributing"] == usual["contributing"] > 0
    for side, cells in itertools.product((8, 16), (1, 3, 5, 20)):
        found, counters = draw(quality, cell_side=side, cache_cells=cells)
        assert found == expected
        few_cells = cells <= (3 if mode == "scope" else 5)
        assert counters["cells_evicted"] > 0 or side == 16 or not few_cells
    monkeypatch.setattr("renderers.art.ranks.scene_look.LARGEST_LEAP", 1)
    for few in (None, 3):
        found, counters = draw(quality, cache_cells=few)
        assert found == expected
        assert counters["skipped"] == 0 or mode == "scope"


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
    found, on = picture(scene, outside, quality)
    everywhere = replace(quality, skip_empty=False)
    expected, off = picture(scene, outside, everywhere)
    assert found == expected
    assert on["contributing"] == off["contributing"] > 0
    assert on["samples"] + on["skipped"] == off["samples"]
    either = film.kappa_per_mm * 0
    either[1:] = 1e-3
    one = replace(scene, transfer_function=replace(film, kappa_per_mm=either))
    _, lone = picture(one, outside, quality)
    assert on["samples"] < 0.9 * lone["samples"]
