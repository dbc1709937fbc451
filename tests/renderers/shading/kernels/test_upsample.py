"""Four pixels at a time get what each gets alone."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.kernels.field_reads import DistanceField, to_voxels
from renderers.shading.kernels.follow_rays import (
    FILM,
    FOUND,
    METAL,
    MIRROR,
    THIN,
    TISSUE,
    BufferView,
    LitWalls,
    follow,
    ray_of,
    wanted_of,
)
from renderers.shading.kernels.path_tracing import (
    FibreLight,
    WallColour,
    albedo_at,
    nearest_code,
)
from renderers.shading.kernels.upsample import LEAST, add_rows
from renderers.shading.tissue_colour import BONE, SKIN_COLOR, colour_row, colour_table

f32 = np.float32
SIZE = (37, 45)
EYE = np.array([8, 8, 8], np.float32)
OTHER = 4


class Scene:
    """A ball of air of 6 mm around the eye; surfaces at random before its wall."""

    def __init__(self, stride: int, effects: int) -> None:
        random = np.random.default_rng(5)
        k = np.arange(33) * 0.5 - 8
        z, y, x = np.meshgrid(k, k, k, indexing="ij")
        height, width = SIZE
        self.stride, self.effects = stride, effects
        self.depth = random.uniform(2, 3, SIZE).astype(np.float32)
        self.depth[:, 20:] *= 2
        self.depth[30, 30] = np.inf
        normal = random.normal((0, 0, -3), 0.5, (*SIZE, 3))
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        self.normal = normal.astype(np.float32)
        self.coverage = random.uniform(0.5, 1, SIZE).astype(np.float32)
        self.coverage[::9, ::7] = 0
        self.material = np.where(random.random(SIZE) < 0.02, OTHER, TISSUE)
        self.material[4:30, 8:28] = METAL
        self.material[12, 12:14] = TISSUE
        self.material = self.material.astype(np.uint8)
        lens = random.normal((0, 0, 3), 0.5, (*SIZE, 3))
        lens /= np.linalg.norm(lens, axis=-1, keepdims=True)
        self.lens = lens.astype(np.float32)
        self.skin = random.integers(0, 256, (33, 33, 33)).astype(np.uint8)
        self.field = DistanceField(
            (np.sqrt(x * x + y * y + z * z) - 6).astype(np.float32),
            np.eye(3, dtype=np.float32) * f32(2),
            2 * EYE,
        )
        beam = FibreLight(
            np.array([[1, 0, 0], [-1, 0, 0]], np.float32),
            np.array([0, 0, 1], np.float32),
            f32(2.8),
            f32(0.5),
        )
        lights = random.normal(size=(8, 20)).astype(np.float32) ** 2
        self.colour = WallColour(
            colour_table(),
            random.integers(0, 256, (33, 33, 33)).astype(np.uint8),
            self.skin,
            np.array(SKIN_COLOR, np.float32),
            colour_row(BONE),
            f32(1),
        )
        self.walls = LitWalls(self.field, beam, self.colour, lights, f32(1.15))
        rows, columns = height // stride + 2, width // stride + 2
        self.grid = random.uniform(-0.1, 1, (rows, columns, FOUND)).astype(np.float32)
        self.reflect = np.array([0.02, 0.55, 0.1, 0.1, 0.1], np.float32)
        self.axes = np.eye(3, dtype=np.float32)
        self.radiance = random.uniform(0, 0.1, (*SIZE, 3)).astype(np.float32)
        self.only = np.ones(SIZE, np.bool_)

    def added(self, *edges: int) -> NDArray[np.float32]:
        radiance = self.radiance.copy()
        view = BufferView(
            self.depth, self.normal, self.coverage, self.material, self.lens, self.axes
        )
        for first, last in itertools.pairwise(edges):
            add_rows(
                view, self.effects, self.stride, self.walls, self.grid, self.reflect,
                self.only, radiance, first, last,
            )  # fmt: skip
        return radiance

    def corners(self, y: int, x: int) -> tuple[NDArray[np.float32], np.float32]:
        """Sum the cell's corners, and their weights, in the kernel's order."""
        stride, (height, width) = self.stride, SIZE
        fy, fx = f32(y % stride) / f32(stride), f32(x % stride) / f32(stride)
        found, total = np.zeros(FOUND, np.float32), f32(0)
        n = self.normal[y, x]
        for corner in range(4):
            right, down = corner & 1, corner >> 1
            row = min((y // stride + down) * stride, height - 1)
            column = min((x // stride + right) * stride, width - 1)
            if self.material[row, column] != self.material[y, x]:
                continue
            if self.coverage[row, column] <= 0:
                continue
            apart = self.depth[row, column] / self.depth[y, x] - f32(1)
            o = self.normal[row, column]
            same = max(n[0] * o[0] + n[1] * o[1] + n[2] * o[2], f32(0))
            k = same * same * same * same / (f32(1) + f32(400) * apart * apart)
            k *= fx if right else f32(1) - fx
            k *= fy if down else f32(1) - fy
            total += k
            found += k * self.grid[y // stride + down, x // stride + right]
        return found, total

    def one_by_one(self) -> tuple[NDArray[np.float32], int]:
        """Add to every pixel alone; tell how many followed light of their own."""
        radiance, own = self.radiance.copy(), 0
        for y, x in np.ndindex(*SIZE):
            kind, t = int(self.material[y, x]), self.depth[y, x]
            wanted = wanted_of(kind, self.effects)
            if wanted == 0 or self.coverage[y, x] <= 0 or not t < 1e6:
                continue
            found, total = self.corners(y, x)
            a, b, c = ray_of(self.lens, self.axes, y, x)
            ray = (f32(a), f32(b), f32(c))
            n = self.normal[y, x]
            place = (f32(t * ray[0]), f32(t * ray[1]), f32(t * ray[2]))
            if total > LEAST:
                found /= total
            else:
                own += 1
                follow(place, ray, (n[0], n[1], n[2]), wanted, self.walls, found)
            if not self.effects & THIN:
                found[3:] = 0
            facing = -(n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2])
            graze = f32(1) - min(max(facing, f32(0)), f32(1))
            f0 = self.reflect[kind]
            rest = f32(1) - f0
            mirrored = f0 + rest * graze * graze * graze * graze * graze
            if kind == METAL:
                # ground matt: an eighth or so of what polished metal would mirror
                mirrored *= f32(0.15)
            if kind == TISSUE:
                dry = nearest_code(self.skin, *to_voxels(self.field, place))
                mirrored *= f32(1) - f32(0.7 / 255) * f32(dry)
            if self.effects & THIN and kind == TISSUE:
                radiance[y, x] -= self.lost(radiance[y, x], found[6:], place)
            more = mirrored * found[:3] + rest * found[3:6]
            lit = radiance[y, x] + self.coverage[y, x] * more
            radiance[y, x] = np.maximum(lit, f32(0))
        return radiance, own

    def lost(
        self,
        seen: NDArray[np.float32],
        share: NDArray[np.float32],
        place: tuple[np.float32, np.float32, np.float32],
    ) -> NDArray[np.float32]:
        """Take a share of what is not the film's sparkle, the same in all colours."""
        x, y, z = (f32(v) for v in to_voxels(self.field, place))
        found = albedo_at(self.colour, x, y, z)
        rho = np.array(found, np.float32)
        lit = max(seen[0] - seen[2], f32(0)) / max(rho[0] - rho[2], f32(1e-3))
        spark = min(max(seen[2] - rho[2] * lit, f32(0)), seen.min())
        return np.asarray((seen - spark) * share)


def test_pixels_that_are_not_wanted_stay() -> None:
    scene = Scene(4, FILM | MIRROR | THIN)
    every = scene.added(0, SIZE[0])
    scene.only = np.random.default_rng(2).random(SIZE) < 0.3
    some = scene.added(0, SIZE[0])
    assert_array_equal(some[scene.only], every[scene.only])
    assert_array_equal(some[~scene.only], scene.radiance[~scene.only])


@pytest.mark.parametrize("stride", [4, 8])
@pytest.mark.parametrize("effects", [MIRROR, FILM | MIRROR, FILM | MIRROR | THIN])
def test_every_pixel_gets_its_own(stride: int, effects: int) -> None:
    scene = Scene(stride, effects)
    expected, own = scene.one_by_one()
    assert own > 5
    found = scene.added(0, SIZE[0])
    assert np.any(found != scene.radiance)
    assert_array_equal(found, expected)
    assert_array_equal(scene.added(0, 7, 8, SIZE[0]), found)
