"""Packets of any width integrate the same, bit by bit, whatever is skipped."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Camera, PhongMaterial, Scene, TransferFunction, Volume

QUALITIES = (
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


def picture(
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


@pytest.mark.parametrize(
    "width", [4, *(pytest.param(w, marks=pytest.mark.slow) for w in (8, 16, 64))]
)
@pytest.mark.parametrize(
    "quality",
    [
        QUALITIES[0],
        # samples in whole numbers compile all the kernels once more
        pytest.param(QUALITIES[1], marks=pytest.mark.slow),
        QUALITIES[2],
    ],
)
def test_any_width_gives_the_same_bits(
    subject: Scene, outside: Camera, quality: Quality, width: int
) -> None:
    expected, before = picture(subject, outside, quality, 32)
    found, after = picture(subject, outside, quality, width)
    assert found == expected
    assert before["contributing"] > 0
    for counter in ("samples", "contributing", "skipped"):
        assert after[counter] == before[counter]


@pytest.mark.parametrize("quality", QUALITIES)
def test_skipping_cells_and_their_coming_change_no_bit(
    subject: Scene, outside: Camera, quality: Quality
) -> None:
    """Rays stop within a step of what they meet, and go on from there."""
    expected, on = picture(subject, outside, quality, 32)
    full = replace(quality, skip_empty=False)
    found, off = picture(subject, outside, full, 32)
    assert found == expected
    assert on["samples"] + on["skipped"] == off["samples"]
    assert on["contributing"] == off["contributing"]
    for side, cells in itertools.product((8, 16), (1, 3, 5)):
        found, after = picture(subject, outside, quality, 32, cells, side)
        assert found == expected
        assert after["cells_evicted"] > 0 or side == 16


def test_volumes_too_large_for_distances_are_drawn_alike(
    subject: Scene, outside: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Empty cells all show one value then, and it belongs to what is clear there."""
    expected, _ = picture(subject, outside, QUALITIES[0], 32)
    monkeypatch.setattr("renderers.art.ranks.prepare.LARGEST_LEAP", 1)
    found, counters = picture(subject, outside, QUALITIES[0], 32)
    assert found == expected
    assert counters["skipped"] == 0
    found, _ = picture(subject, outside, QUALITIES[0], 32, 5)
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
    found, on = picture(scene, outside, quality, 32)
    everywhere = replace(quality, skip_empty=False)
    expected, off = picture(scene, outside, everywhere, 32)
    assert found == expected
    assert on["contributing"] == off["contributing"] > 0
    assert on["samples"] + on["skipped"] == off["samples"]
    either = film.kappa_per_mm * 0
    either[1:] = 1e-3
    one = replace(scene, transfer_function=replace(film, kappa_per_mm=either))
    _, lone = picture(one, outside, quality, 32)
    assert on["samples"] < 0.9 * lone["samples"]
