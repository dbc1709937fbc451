from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.march import ClassicMarch, FrameRays, ScopeMarch
from renderers.art.quality import ClassificationName
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.prepare import make_node
from renderers.art.regions import Region
from renderers.scene import Camera, Light, PhongMaterial, Scene, Volume, four_lights


def test_the_scope_needs_a_surface(scene: Scene) -> None:
    bare = Scene(scene.volume, scene.transfer_function)
    with pytest.raises(ValueError, match="no air surface"):
        ScopeMarch(bare, Quality(0.5, 0.0))


def test_too_many_samples_are_refused(scene: Scene) -> None:
    long = Volume(
        np.zeros((2, 2, 40_000), np.int16), np.array([1.0, 1, 1]), np.zeros(3)
    )
    with pytest.raises(ValueError, match="choose a larger one"):
        ClassicMarch(Scene(long, scene.transfer_function), Quality(1 / 256, 0), (0, 1))


def test_odd_packets_are_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match="4, 8, 16, 32 or 64 rays, got 12"):
        ScopeMarch(scene, Quality(0.5, 0.0), 12)


@pytest.mark.parametrize("kind", get_args(ClassificationName))
def test_each_thing_that_is_skipped_is_counted_and_changes_no_bit(
    scene: Scene, outside: Camera, kind: ClassificationName
) -> None:
    """Gradients that light nothing, lights that give nothing, rays that end at once."""
    quality = Quality(0.5, 0.0, classification=kind)

    def drawn(
        lights: tuple[Light, ...], material: PhongMaterial, limit: float | None = None
    ) -> tuple[NDArray[np.float32], dict[str, int], int]:
        lit = replace(scene, lights=lights, material=material)
        tracer = ActiveRayTracer(lit, quality)
        ends = None
        if limit is not None:
            ends = np.full((outside.height, outside.width), limit, np.float32)
        rgba = tracer.render(outside, limit_mm=ends).rgba
        assert tracer.report is not None
        return rgba, tracer.report.counters, tracer.memory

    plain, counters, memory = drawn((), PhongMaterial(1.0, 0.0))
    # no light and full ambience: a sample has its own colour, whatever its normal;
    # so it has beside a light too dim for the last digit of 1
    dim, off = (replace(four_lights()[0], color=np.full(3, c)) for c in (1e-30, 0.0))
    shaded, shaded_counters, shaded_memory = drawn((dim,), PhongMaterial(1.0))
    assert np.array_equal(plain, shaded)
    assert counters["contributing"] == shaded_counters["contributing"] > 0
    # no gradient is made, and no brick: an int16 or float32 a voxel and a distance
    voxels = scene.volume.values.size
    assert memory <= 5.5 * voxels < shaded_memory
    assert counters["cells_fetched"] == 0 < shaded_counters["cells_fetched"]
    for unlit in (
        drawn((off,) * 3, PhongMaterial(1.0)),
        drawn(four_lights(), PhongMaterial(1.0, 0.0)),
    ):
        assert np.array_equal(unlit[0], plain)
        assert unlit[1:] == (counters, memory)
    some, some_counters, _ = drawn((*four_lights(), off), PhongMaterial())
    wanted, wanted_counters, _ = drawn(four_lights(), PhongMaterial())
    assert np.array_equal(some, wanted)
    assert some_counters == wanted_counters
    nothing, counters, _ = drawn(four_lights(), PhongMaterial(), 0.0)
    assert not nothing.any()
    assert counters["samples"] == counters["skipped"] == counters["cells_fetched"] == 0


INTEGRATED = Quality(0.5, 1 / 1024, classification="integrated")


def test_rays_without_their_last_samples_are_refused(
    scene: Scene, outside: Camera
) -> None:
    march, _, work = make_node(scene, "classic", INTEGRATED)
    packet = march.start(Region(0, 0, 8, 8), FrameRays.of(outside))
    packet.front = packet.front[:0]
    with pytest.raises(ProtocolError, match="without their last samples"):
        march.run(packet, work.bricks.view, 3, 0)


def test_classification_is_one_of_two() -> None:
    wrong: Any = "both"
    with pytest.raises(ValueError, match="post or integrated, got 'both'"):
        Quality(0.5, 0.0, classification=wrong)
