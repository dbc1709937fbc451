import itertools

import numpy as np
import pytest

from renderers.scene import Camera
from renderers.shading import ScopeLight, Tier


@pytest.mark.parametrize("count", [2, 6, 24])
def test_sources_lie_on_the_ring_across_the_view_axis(
    camera: Camera, count: int
) -> None:
    light = ScopeLight(1.45)
    sources = light.sources(camera, count)
    np.testing.assert_allclose(np.linalg.norm(sources, axis=1), 1.45, rtol=1e-6)
    np.testing.assert_allclose(sources @ camera.frame[3], 0, atol=1e-6)
    # two crescents face each other
    half = count // 2
    np.testing.assert_allclose(sources[:half], -sources[half:], atol=1e-6)
    # six sources at -34, 0, 34 degrees, as two fibre bundles lie
    if count == 6:
        angle = np.degrees(np.arcsin(sources[:3] @ camera.frame[2] / 1.45))
        np.testing.assert_allclose(angle, [-34.4, 0, 34.4], atol=0.1)


def test_known_scopes_have_their_rings() -> None:
    assert ScopeLight.for_diameter(4.0).ring_radius_mm == pytest.approx(1.45)
    assert ScopeLight.for_diameter(2.7).ring_radius_mm == pytest.approx(0.95)


def test_tiers_only_get_finer() -> None:
    tiers = [tier for tier in Tier if not tier.half_light]
    for coarse, fine in itertools.pairwise(tiers):
        assert fine.sources >= coarse.sources
        assert fine.virtual_lights > coarse.virtual_lights
        assert fine.supersampling >= coarse.supersampling
    assert Tier.FLIGHT.value[:-1] == Tier.LIVE.value


def test_impossible_lights_are_refused(camera: Camera) -> None:
    with pytest.raises(ValueError, match=r"ring_radius_mm.*-1"):
        ScopeLight(-1.0)
    with pytest.raises(ValueError, match="spread"):
        ScopeLight(spread=float("nan"))
    with pytest.raises(ValueError, match="even count"):
        ScopeLight().sources(camera, 3)
    with pytest.raises(ValueError, match="40 mm"):
        ScopeLight.for_diameter(40)
