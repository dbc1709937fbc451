import math

import numpy as np
import pytest

from renderers.fsr import FuzzySet, Inclusion, extract_fuzzy_set
from renderers.fsr.classic import SplatMode, SplatRasterizer
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)


def transfer(kappa: float) -> TransferFunction:
    return TransferFunction(
        np.array([0.0, 50.0, 200.0]),
        np.tile([0.8, 0.6, 0.4], (3, 1)),
        np.array([0.0, kappa, kappa]),
    )


def unlit(volume: Volume, kappa: float) -> tuple[FuzzySet, Scene]:
    scene = Scene(
        volume,
        transfer(kappa),
        lights=(),
        material=PhongMaterial(ambient=1.0, diffuse=0.0),
    )
    inclusion = Inclusion.opacity(scene.transfer_function, 1.0)
    return extract_fuzzy_set(volume, inclusion, 1e-4), scene


def slab(layers: int = 6, spacing: tuple[float, float, float] = (1, 1, 1)) -> Volume:
    values = np.full((layers, 40, 40), 100, np.float32)
    return Volume(values, np.array(spacing, float), np.zeros(3), background=0.0)


def above(volume: Volume, half_mm: float = 8.0, size: int = 120) -> Camera:
    x, y, _ = volume.center_mm
    return Camera.looking_at(
        (x, y, 80.0),
        (x, y, 0.0),
        up=(0, 1, 0),
        extent=half_mm,
        size=(size, size),
        projection=Projection.ORTHOGRAPHIC,
    )


def test_what_is_behind_an_instrument_is_hidden_pixel_by_pixel(
    team: ThreadTeam,
) -> None:
    volume = slab()
    drawer = SplatRasterizer(*unlit(volume, 0.3))
    camera = above(volume)
    limit = np.full((120, 120), np.inf, np.float32)
    limit[:, :60] = 1.0
    limit[:40, 60:] = 1e6
    free = drawer.draw(camera, team)
    cut = drawer.draw(camera, team, limit_mm=limit)
    assert not cut.rgba[:, :60].any()
    assert cut.rgba[:, 60:].tobytes() == free.rgba[:, 60:].tobytes()
    middle = np.full((120, 120), 80.0 - 2.5, np.float32)  # half of six layers
    half = drawer.draw(camera, team, limit_mm=middle).rgba[..., 3]
    assert half.mean() == pytest.approx(-math.expm1(-0.3 * 3), rel=0.02)
    with pytest.raises(ValueError, match="do not fit"):
        drawer.draw(camera, team, limit_mm=limit[:50])


def test_depth_is_where_half_of_the_light_is_gone(team: ThreadTeam) -> None:
    volume = slab()
    drawer = SplatRasterizer(*unlit(volume, 5.0))
    for mode in SplatMode:
        image = drawer.draw(above(volume), team, mode, with_depth=True)
        assert image.depth_mm is not None
        np.testing.assert_allclose(image.depth_mm, 80.0 - 5.0, atol=1.0)
    faint = SplatRasterizer(*unlit(volume, 0.01))
    image = faint.draw(above(volume), team, with_depth=True)
    assert image.depth_mm is not None
    assert np.all(np.isinf(image.depth_mm))
