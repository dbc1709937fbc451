"""After edits in place everything equals what is built anew, to the bit."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.surfels.surfel_pool import LEAST_SPARE, SurfelPool
from renderers.fsr.visibility import build_visible_sets
from renderers.scene import Camera, Change, ChangeKind, Volume
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.same_buffers import same


class Owner:
    """Own a distance field and edit it in place."""

    def __init__(self, volume: Volume) -> None:
        self.first = volume.values
        self.values = volume.values.copy()
        self.volume = volume.with_values(self.values, volume.background)
        self.generation = 0

    def take(
        self, tool: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    ) -> Change:
        """Carve what is within a tool, a distance by places in voxels (..., 3).

        Deeper than 1.5 mm in tissue the distance stays what it was.
        """
        k, j, i = np.indices(self.values.shape)
        inside = tool(np.stack([i, j, k], axis=-1).astype(np.float64))
        inside = np.where(inside < 1.5, inside, np.inf).astype(np.float32)
        return self.become(np.minimum(self.values, inside))

    def capsule(
        self, a: NDArray[np.float64], b: NDArray[np.float64], radius: float
    ) -> Change:
        """Carve a capsule between places in voxels; radius in mm."""
        spacing = self.volume.spacing_mm

        def tool(at: NDArray[np.float64]) -> NDArray[np.float64]:
            along, p = (b - a) * spacing, (at - a) * spacing
            share = np.clip(p @ along / max(float(along @ along), 1e-9), 0, 1)
            off = p - share[..., None] * along
            return np.asarray(np.linalg.norm(off, axis=-1) - radius)

        return self.take(tool)

    def become(self, values: NDArray[np.float32]) -> Change:
        """Take other values over; tell the box of what is different."""
        places = np.argwhere(values != self.values)[:, ::-1]
        self.values[...] = values
        self.generation += 1
        if len(places) == 0:
            return Change(self.generation, np.zeros(3, np.int64), np.full(3, -1))
        return Change(self.generation, places.min(axis=0), places.max(axis=0))


def blocks_of(
    pool: SurfelPool,
) -> tuple[list[NDArray[np.float32]], list[NDArray[np.float32]]]:
    begins, ends, _ = pool.spans
    spans = list(zip(begins.tolist(), ends.tolist(), strict=True))
    return [pool.position[a:b] for a, b in spans], [pool.normal[a:b] for a, b in spans]


def assert_same_surfels(live: SurfelRasterizer, fresh: SurfelRasterizer) -> None:
    np.testing.assert_array_equal(live._blocks.numbers, fresh._blocks.numbers)
    for a, b in ((live._coarse, fresh._coarse), (live._fine, fresh._fine)):
        np.testing.assert_array_equal(a.spans.rows, b.spans.rows)
        for found, wanted in zip(blocks_of(a), blocks_of(b), strict=True):
            assert [len(x) for x in found] == [len(x) for x in wanted]
            if found:
                np.testing.assert_array_equal(
                    np.concatenate(found), np.concatenate(wanted)
                )
        far, wanted_far = (np.unique(p.far, axis=0) for p in (a, b))
        np.testing.assert_array_equal(far, wanted_far)
        assert len(a) == len(b)


def eyes_in(volume: Volume, rng: np.random.Generator, count: int) -> list[Camera]:
    """Look from anywhere in air, anywhere."""
    air = np.argwhere(volume.values < -0.5)[:, ::-1]
    if len(air) == 0:
        air = np.array([volume.shape[::-1]]) // 2
    matrix = volume.world_from_voxel
    eyes = air[rng.integers(len(air), size=count)] @ matrix[:3, :3].T + matrix[:3, 3]
    return [Camera.looking_at(e, e + rng.normal(size=3), size=(48, 48)) for e in eyes]


def assert_same_pictures(
    live: SurfelRasterizer, fresh: SurfelRasterizer, cameras: list[Camera],
    teams: tuple[ThreadPool, ...],
) -> None:  # fmt: skip
    for camera in cameras:
        wanted = fresh.draw(camera, teams[0])
        for pool in teams:
            assert same(live.draw(camera, pool), wanted)
            # also what is listed and left out, so that nothing dead is carried along
            assert live.counters == fresh.counters


def odd_grid(seed: int) -> Volume:
    """A field of caves on a turned grid of unlike spacings, not one of distances."""
    rng = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(rng.normal(size=(19, 26, 23)), 2.0)
    values = (noise / noise.std()).astype(np.float32)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Volume(values, np.array([0.4, 0.7, 0.5]), rng.normal(size=3) * 50, turn)


@settings(max_examples=12)
@given(seed=st.integers(0, 2**32 - 1), edits=st.integers(1, 6))
def test_surfels_and_pictures_after_edits_are_those_of_a_new_rasterizer(
    pool: ThreadPool, seed: int, edits: int
) -> None:
    rng = np.random.default_rng(seed)
    owner = Owner(odd_grid(seed))
    live = SurfelRasterizer(owner.volume)
    cameras = eyes_in(owner.volume, rng, 2)
    before = [live.draw(camera, pool) for camera in cameras]
    top = np.array(owner.volume.shape[::-1])
    for _ in range(edits):
        # the ends may lie outside the grid
        a, b = rng.uniform(-2, top + 2, (2, 3))
        live.update(owner.capsule(a, a + 0.3 * (b - a), rng.uniform(0.4, 2.5)))
        assert_same_surfels(live, SurfelRasterizer(owner.volume))
    fresh = SurfelRasterizer(owner.volume)
    assert_same_pictures(
        live, fresh, [*cameras, *eyes_in(owner.volume, rng, 1)], (pool,)
    )
    live.update(owner.become(owner.first))
    assert_same_surfels(live, SurfelRasterizer(owner.volume))
    for camera, wanted in zip(cameras, before, strict=True):
        assert same(live.draw(camera, pool), wanted)


def test_elements_that_are_led_far_away_follow_what_they_met_there() -> None:
    """Where a field is flat Newton's steps are long; such elements exist here."""
    far = 0
    for seed in range(4):
        owner = Owner(odd_grid(seed))
        live = SurfelRasterizer(owner.volume)
        rng = np.random.default_rng(seed)
        for _ in range(12):
            a = rng.uniform(0, owner.volume.shape[::-1], 3)
            live.update(owner.capsule(a, a + 0.5, 0.5))
        assert_same_surfels(live, SurfelRasterizer(owner.volume))
        far += len(live._coarse.far) + len(live._fine.far)
    assert far > 50


def test_blocks_become_full_and_empty(hollow: Volume, pool: ThreadPool) -> None:
    owner = Owner(hollow)
    live = SurfelRasterizer(owner.volume)
    numbers = live._blocks.numbers
    # a bubble in tissue: its blocks held nothing
    bubble = owner.capsule(np.full(3, 3.0), np.full(3, 3.0), 0.6)
    live.update(bubble)
    assert len(live._blocks.numbers) > len(numbers)
    assert_same_surfels(live, SurfelRasterizer(owner.volume))
    # all becomes air, then tissue: no block holds anything
    for value in (-5.0, 5.0):
        live.update(owner.become(np.full(hollow.shape, value, np.float32)))
        assert live.splat_count == len(live._blocks.numbers) == 0
        camera = Camera.looking_at((0, 0, 0), (0, 4, 0), size=(32, 32))
        assert not live.draw(camera, pool).coverage.any()
    live.update(owner.become(owner.first))
    np.testing.assert_array_equal(live._blocks.numbers, numbers)
    assert_same_surfels(live, SurfelRasterizer(owner.volume))


def test_the_same_edit_done_and_undone_takes_no_more_memory(hollow: Volume) -> None:
    owner = Owner(hollow)
    live = SurfelRasterizer(owner.volume)
    rng = np.random.default_rng(7)
    most, sizes = 0, []
    for _ in range(150):
        a = rng.uniform(2, 30, 3)
        live.update(owner.capsule(a, a + rng.normal(size=3), 1.5))
        most = max(most, len(live._fine))
        live.update(owner.become(owner.first))
        sizes.append(live._fine.size)
    assert_same_surfels(live, SurfelRasterizer(owner.volume))
    # without reuse it would have room for fifty times as many
    assert max(sizes) <= 2 * most + LEAST_SPARE


def test_a_pool_that_is_full_is_written_anew(
    hollow: Volume, monkeypatch: pytest.MonkeyPatch, pool: ThreadPool
) -> None:
    monkeypatch.setattr("renderers.fsr.surfels.surfel_pool.LEAST_SPARE", 0)
    owner = Owner(hollow)
    live = SurfelRasterizer(owner.volume)
    sizes = {live._fine.size}
    rng = np.random.default_rng(3)
    for _ in range(40):
        a = rng.uniform(2, 30, 3)
        live.update(owner.capsule(a, a, 2.0))
        sizes.add(live._fine.size)
    assert len(sizes) > 2
    fresh = SurfelRasterizer(owner.volume)
    assert_same_surfels(live, fresh)
    assert_same_pictures(live, fresh, eyes_in(owner.volume, rng, 2), (pool,))


def test_a_box_that_is_larger_than_the_change_does_no_harm(hollow: Volume) -> None:
    owner = Owner(hollow)
    live = SurfelRasterizer(owner.volume)
    for _ in range(2):
        change = owner.capsule(np.full(3, 26.0), np.full(3, 28.0), 1.0)
        live.update(Change(change.generation, np.full(3, -40), np.full(3, 400)))
        live.update(change)
    # nor does one in which nothing is different
    live.update(Change(9, np.full(3, 2), np.full(3, 3)))
    assert_same_surfels(live, SurfelRasterizer(owner.volume))


def test_film_changes_no_surface(hollow: Volume) -> None:
    live = SurfelRasterizer(hollow)
    before = live._fine.position
    whole = np.zeros(3, np.int64), np.full(3, 32)
    live.update(Change(1, *whole, ChangeKind.FILM))
    assert live._before is None
    assert live._fine.position is before


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32 - 1))
def test_visible_sets_leave_out_no_block_that_a_new_flood_sees(
    cavities: Volume, pool: ThreadPool, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    owner = Owner(cavities)
    live = SurfelRasterizer(owner.volume)
    live.use_visible_sets(build_visible_sets(owner.volume, live.bounds(), pool))
    for _ in range(3):
        a = rng.uniform(0, cavities.shape[::-1], 3)
        live.update(owner.capsule(a, a + rng.normal(size=3), rng.uniform(0.6, 2.0)))
        # in tissue, where nothing but its own blocks is near
        bubble = np.array([3.0, 3, 3]) + rng.uniform(0, 2, 3)
        live.update(owner.capsule(bubble, bubble, 0.5))
        assert_answers_hold(live, owner.volume, pool, rng)


def test_visible_sets_hold_where_an_edit_is_out_of_sight(
    cavities: Volume, pool: ThreadPool
) -> None:
    owner = Owner(cavities)
    live = SurfelRasterizer(owner.volume)
    live.use_visible_sets(build_visible_sets(owner.volume, live.bounds(), pool))
    live.update(owner.capsule(np.ones(3), np.ones(3), 0.5))
    answered = assert_answers_hold(live, owner.volume, pool, np.random.default_rng(2))
    assert answered > 20


def assert_answers_hold(
    live: SurfelRasterizer, volume: Volume, pool: ThreadPool, rng: np.random.Generator
) -> int:
    """Compare with sets found anew from 30 places; return how many had an answer."""
    fresh = SurfelRasterizer(volume)
    fresh.use_visible_sets(build_visible_sets(volume, fresh.bounds(), pool))
    assert live._lookup is not None
    assert fresh._lookup is not None
    answered = 0
    for camera in eyes_in(volume, rng, 30):
        wanted = fresh._lookup.seen_from(camera.eye_mm)
        seen = live._lookup.seen_from(camera.eye_mm)
        answered += seen is not None
        assert wanted is None or seen is None or np.all(seen >= wanted)
    return answered


def test_an_eye_that_an_edit_may_show_something_to_asks_cones(
    cavities: Volume, pool: ThreadPool
) -> None:
    owner = Owner(cavities)
    live = SurfelRasterizer(owner.volume)
    live.use_visible_sets(build_visible_sets(owner.volume, live.bounds(), pool))
    camera = Camera.looking_at((-6.5, -0.4, 0.3), (5.0, 0.0, 0.0), size=(32, 32))
    live.draw(camera, pool)
    assert live.counters["looked up"] == 1
    # a second opening in the wall between the cavities
    live.update(owner.capsule(np.array([30.0, 20, 20]), np.array([31.0, 20, 20]), 1.2))
    assert same(
        live.draw(camera, pool), SurfelRasterizer(owner.volume).draw(camera, pool)
    )
    assert live.counters["looked up"] == 0
