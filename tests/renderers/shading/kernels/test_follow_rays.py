"""Mirrored and transmitted light in rooms where it is known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.shading.kernels.field_reads import DistanceField
from renderers.shading.kernels.follow_rays import (
    FOUND,
    METAL,
    MIRROR,
    STRAY_PER_MM,
    THIN,
    TISSUE,
    LitWalls,
    blur_mirrored,
    bounced,
    follow,
    wanted_of,
)
from renderers.shading.kernels.path_tracing import FibreLight, WallColour
from renderers.shading.kernels.thin_walls import wall, with_cell
from renderers.shading.tissue_colour import BONE, SKIN_COLOR, colour_row, colour_table

f32 = np.float32
SPACING = 0.25
NO_LIGHTS = np.zeros((8, 0), np.float32)
FORWARD = np.array([0, 0, 1], np.float32)
SKIN = np.array(SKIN_COLOR, np.float32)
TABLE = colour_table()
BONE_ROW = colour_row(BONE)
CODE = 100


def room(distance: NDArray[np.float64], eye: list[float], at: list[float],
         ray: list[float], normal: list[float], wanted: int,
         sources: list[list[float]], lights: NDArray[np.float32] = NO_LIGHTS) -> (
    NDArray[np.float32]
):  # fmt: skip
    """Follow a point of a room; eye in mm from the grid's corner, the rest from it."""
    code = np.full(distance.shape, CODE, np.uint8)
    found = np.empty(FOUND, np.float32)

    def three(v: list[float]) -> tuple[np.float32, np.float32, np.float32]:
        return f32(v[0]), f32(v[1]), f32(v[2])

    walls = LitWalls(
        DistanceField(
            distance.astype(np.float32),
            np.eye(3, dtype=np.float32) / f32(SPACING),
            np.array(eye, np.float32) / f32(SPACING),
        ),
        FibreLight(np.array(sources, np.float32), FORWARD, f32(0), f32(2.0)),
        WallColour(TABLE, code, np.zeros_like(code), SKIN, BONE_ROW, f32(1)),
        lights,
        f32(1.15),
    )
    follow(three(at), three(ray), three(normal), wanted, walls, found)
    return found


def grid(n: int) -> tuple[NDArray[np.float64], ...]:
    z, y, x = np.meshgrid(*[np.arange(n) * SPACING] * 3, indexing="ij")
    return x, y, z


def test_a_mirror_shows_the_wall_of_a_ball() -> None:
    """The wall of a ball around the light is lit by 1 / R^2, wherever one looks."""
    x, y, z = grid(97)
    middle, radius = 12.0, 10.0
    distance = np.sqrt((x - middle) ** 2 + (y - middle) ** 2 + (z - middle) ** 2)
    s = np.sqrt(0.5)
    found = room(
        distance - radius, [middle] * 3, [0, 0, 3], [0, 0, 1], [s, 0, -s], MIRROR,
        [[0, 0, 0]],
    )  # fmt: skip
    expected = TABLE[CODE, :3] / np.pi * 2.0 / radius**2
    np.testing.assert_allclose(found[:3], expected, rtol=0.02)
    assert not found[3:].any()


def test_a_mirror_turned_away_shows_nothing() -> None:
    x, *_ = grid(41)
    found = room(x - 8, [2, 5, 5], [1, 0, 0], [1, 0, 0], [1, 0, 0], MIRROR, [[0, 0, 0]])
    assert not found.any()


@pytest.mark.parametrize("thickness", [0.5, 1.0, 1.5])
def test_a_wall_lit_from_behind_glows_by_the_slab_law(thickness: float) -> None:
    """Eye before a wall, light on its other side only."""
    x, *_ = grid(81)
    middle = 10.0
    distance = thickness / 2 - np.abs(x - middle)
    eye = [5.0, 10, 10]
    front = middle - thickness / 2 - eye[0]
    lamp = [front + thickness + 4.0, 0, 0]
    found = room(
        distance, eye, [front, 0, 0], [1, 0, 0], [-1, 0, 0], THIN, [lamp]
    )  # fmt: skip
    # what is not scattered on its way goes straight on
    falls = 2.0 / 4.0**2 * (1 - np.exp(-STRAY_PER_MM * thickness))
    for c in range(3):
        k = 3 if c == 0 else 4
        through, _ = wall(
            f32(thickness), TABLE[CODE, c], TABLE[CODE, k], BONE_ROW[c], BONE_ROW[k]
        )
        # the way through is found in steps
        assert found[3 + c] == pytest.approx(
            float(through) * falls / np.pi, rel=0.25, abs=1e-5
        )
    # red goes farther through tissue
    assert found[3] > 3 * found[4] > 0


def test_a_thin_wall_lit_from_the_front_loses_light_and_a_thick_one_none() -> None:
    x, *_ = grid(81)
    thin = 0.25 - np.abs(x - 10)
    found = room(
        thin, [5, 10, 10], [4.75, 0, 0], [1, 0, 0], [-1, 0, 0], THIN, [[0, 0, 0]]
    )
    assert not found[3:6].any()
    # red goes astray behind; bone shines through with green and blue
    assert found[6] > 0
    assert np.all(found[7:] < 0)
    thick = 4.0 - np.abs(x - 10)
    found = room(
        thick, [3, 10, 10], [3.0, 0, 0], [1, 0, 0], [-1, 0, 0], THIN, [[0, 0, 0]]
    )
    assert not found.any()


def wedge(angle_deg: float, thickness: float = 0.8) -> NDArray[np.float32]:
    """Follow a point on one face of a wedge, so thick there, lit from all around."""
    x, y, _ = grid(97)
    at = 12.0
    angle = np.radians(angle_deg)
    # tissue from the face x = at to one that comes nearer along y
    far = (at + thickness - x) * np.cos(angle) - (y - at) * np.sin(angle)
    distance = np.minimum(x - at, far)
    lamps = [[-4.0, 0, 0], [thickness + 4.0, 0, 0]]
    eye = [at, at, at]
    return room(distance, eye, [0, 0, 0], [1, 0, 0], [-1, 0, 0], THIN, lamps)


def test_an_edge_is_no_thin_wall() -> None:
    """Bone does not shine through where a cut or a ridge ends, nor does light."""
    level, slight, steep, edge = (wedge(angle) for angle in (0, 20, 45, 75))
    assert np.all(np.abs(level[3:]) > 1e-5)
    # a fifth less light falls on a slighter face
    np.testing.assert_allclose(slight[6:], level[6:], rtol=0.1, atol=2e-3)
    shares = (np.cos(np.radians(45)) - 0.5) / (0.866 - 0.5)
    np.testing.assert_allclose(steep[6:], shares * level[6:], rtol=0.15, atol=2e-3)
    assert np.all(np.abs(steep[3:6]) < slight[3:6])
    assert not edge[3:].any()


@pytest.mark.parametrize("code", [50, 76, 85, 100, 120])
def test_no_wall_turns_green(code: int) -> None:
    """Red stays the strongest by far, whatever the wall's thickness."""
    thick = seen_wall(code, 2.5)
    for thickness in np.linspace(0.15, 2.5, 20):
        red, green, blue = TABLE[code, :3] * seen_wall(code, thickness) / thick
        assert red > 1.3 * green
        assert red > 1.3 * blue


def seen_wall(code: int, thickness: float) -> NDArray[np.float64]:
    """Give what a wall and its cell send back, red, green and blue."""
    found = [
        with_cell(
            *wall(
                f32(thickness), TABLE[code, c], TABLE[code, k], BONE_ROW[c], BONE_ROW[k]
            ),
            TABLE[code, c],
        )
        for c, k in ((0, 3), (1, 4), (2, 4))
    ]
    return np.array(found, np.float64)


@pytest.mark.parametrize("count", [1, 15, 16, 17, 200])
def test_any_number_of_virtual_lights_is_their_sum_in_float64(count: int) -> None:
    rng = np.random.default_rng(count)
    light = rng.standard_normal((8, count)).astype(np.float32)
    light[6:] = np.abs(light[6:]) + 0.5
    at, normal = rng.standard_normal((2, 3)).astype(np.float32)
    away = light[:3].T.astype(np.float64) - at
    receive = np.maximum(away @ normal, 0)
    emit = np.maximum(-(away * light[3:6].T).sum(axis=1), 0)
    d2 = (away**2).sum(axis=1) + light[7]
    expected = float((light[6] * receive * emit / d2**2).sum()) / np.pi
    assert bounced(light, tuple(at), tuple(normal)) == pytest.approx(expected, 1e-5)


def test_metal_mirrors_and_tissue_does_not_unless_wet() -> None:
    assert wanted_of(METAL, MIRROR) == MIRROR
    assert wanted_of(TISSUE, MIRROR) == 0
    assert wanted_of(METAL, THIN) == 0
    assert wanted_of(TISSUE, THIN | MIRROR) == THIN
    assert wanted_of(4, 7) == 0


def test_the_blur_keeps_even_light_and_stays_on_the_metal() -> None:
    size, stride = 64, 8
    depth = np.full((size, size), 10, np.float32)
    normal = np.zeros((size, size, 3), np.float32)
    normal[..., 2] = -1
    material = np.zeros((size, size), np.uint8)
    material[:, 24:] = METAL
    lattice = np.zeros((10, 10, 6), np.float32)
    lattice[:, 3:, :3] = 0.5
    lattice[:, :3] = 9.0
    blurred = np.empty_like(lattice)
    every = np.ones(lattice.shape[:2], np.bool_)
    for first, last in ((0, 4), (4, 10)):
        blur_mirrored(
            depth, normal, material, stride, 20, every, lattice, blurred, first, last
        )
    np.testing.assert_allclose(blurred[:, 3:, :3], 0.5, rtol=1e-6)
    np.testing.assert_array_equal(blurred[:, :3], lattice[:, :3])
