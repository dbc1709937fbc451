import math

import numpy as np
import pytest

from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.splat_scenes import above, slab, unlit


def test_what_is_behind_an_instrument_is_hidden_pixel_by_pixel(
    pool: ThreadPool,
) -> None:
    volume = slab()
    drawer = SplatRasterizer(*unlit(volume, 0.3))
    camera = above(volume)
    limit = np.full((120, 120), np.inf, np.float32)
    limit[:, :60] = 1.0
    limit[:40, 60:] = 1e6
    free = drawer.draw(camera, pool)
    cut = drawer.draw(camera, pool, limit_mm=limit)
    assert not cut.rgba[:, :60].any()
    assert cut.rgba[:, 60:].tobytes() == free.rgba[:, 60:].tobytes()
    middle = np.full((120, 120), 80.0 - 2.5, np.float32)  # half of six layers
    half = drawer.draw(camera, pool, limit_mm=middle).rgba[..., 3]
    assert half.mean() == pytest.approx(-math.expm1(-0.3 * 3), rel=0.02)
    with pytest.raises(ValueError, match="do not fit"):
        drawer.draw(camera, pool, limit_mm=limit[:50])


def test_depth_is_where_half_of_the_light_is_gone(pool: ThreadPool) -> None:
    volume = slab()
    drawer = SplatRasterizer(*unlit(volume, 5.0))
    for mode in SplatMode:
        image = drawer.draw(above(volume), pool, mode, with_depth=True)
        assert image.depth_mm is not None
        np.testing.assert_allclose(image.depth_mm, 80.0 - 5.0, atol=1.0)
    faint = SplatRasterizer(*unlit(volume, 0.01))
    image = faint.draw(above(volume), pool, with_depth=True)
    assert image.depth_mm is not None
    assert np.all(np.isinf(image.depth_mm))
