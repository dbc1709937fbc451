import pytest

from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.scene import Camera, Projection
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.splat_scenes import blob


@pytest.mark.parametrize("projection", Projection)
def test_one_call_gives_the_bits_and_counts_of_two(
    pool: ThreadPool, three: ThreadPool, projection: Projection
) -> None:
    """From outside, and from among subdivided splats: more than the set has."""
    drawer = SplatRasterizer(*blob())
    flat = projection is Projection.ORTHOGRAPHIC
    for eye in ((5, -9, 6), (5.2, 1.1, 4.3)):
        camera = Camera.looking_at(
            eye, (5, 5, 4), extent=6.0 if flat else 0.7, size=(90, 130),
            projection=projection,
        )  # fmt: skip
        for mode in SplatMode:
            for drawn_by in (pool, three):
                lists = drawer.prepare(camera, mode, threads=drawn_by.threads)
                two = drawer.draw_list(lists, drawn_by, with_depth=True)
                of_two = drawer.counters
                one = drawer.draw(camera, drawn_by, mode, with_depth=True)
                assert one.rgba.tobytes() == two.rgba.tobytes()
                assert one.depth_mm is not None
                assert two.depth_mm is not None
                assert one.depth_mm.tobytes() == two.depth_mm.tobytes()
                assert drawn_by is three or drawer.counters == of_two


def test_where_there_is_no_room_it_is_made(pool: ThreadPool) -> None:
    """Of a new rasterizer, which has none, and for parts of splats that are near."""
    fuzzy, scene = blob()
    kept = SplatRasterizer(fuzzy, scene)
    splits, shown = [], []
    for eye in ((5, -60, 6), (5, -9, 6), (5.2, 1.1, 4.3), (5, -60, 6)):
        camera = Camera.looking_at(eye, (5, 5, 4), size=(64, 48))
        new = SplatRasterizer(fuzzy, scene)
        assert new.draw(camera, pool).rgba.tobytes() == (
            kept.draw(camera, pool).rgba.tobytes()
        )
        assert new.counters == kept.counters
        splits.append(new.counters["subdivided"])
        shown.append(new.counters["visible"])
    assert shown[0] == shown[-1] > 0
    assert splits[0] == 0 < max(splits)
