from dataclasses import replace
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer
from renderers.art.quality import Quality
from renderers.art.step_estimation import StepEstimate
from renderers.scene import Camera, Change, ChangeKind, Scene
from tests.operated import Operated
from tests.slow_cases import slow

BITES = st.lists(
    st.tuples(
        st.tuples(st.integers(0, 33), st.integers(0, 26), st.integers(0, 40)),
        st.floats(0.5, 6),
        st.booleans(),
    ),
    min_size=1,
    max_size=4,
)

"""Places, radii, and whether all is undone instead."""

Bites = list[tuple[tuple[int, int, int], float, bool]]


@settings(max_examples=8)
@given(bites=BITES)
def test_a_step_that_follows_is_one_estimated_afresh(
    scene: Scene, bites: Bites
) -> None:
    head, quality = Operated.of(scene), replace(Quality.named("final"), tolerance=3e-4)
    estimate = StepEstimate(head.scene, quality)
    for place, radius, undoes in bites:
        change = head.undo() if undoes else head.bite(place, radius)
        found = estimate.follow(head.scene, change.low[::-1], change.high[::-1])
        assert found == StepEstimate(head.scene, quality).quality


def drawn(
    tracer: ActiveRayTracer, outside: Camera, inside: Camera
) -> list[NDArray[Any]]:
    buffer, image = tracer.gbuffer(inside), tracer.render(outside)
    assert image.depth_mm is not None
    return [buffer.depth_mm, buffer.normal, buffer.coverage, image.rgba, image.depth_mm]


@pytest.mark.parametrize(
    ("quality", "cells"),
    [("snapshot", 7), *slow(("snapshot", None), ("preview", None), ("final", None))],
)
@settings(max_examples=6)
@given(bites=BITES)
def test_a_tracer_that_follows_draws_what_a_new_one_draws(
    scene: Scene,
    outside: Camera,
    inside: Camera,
    quality: str,
    cells: int | None,
    bites: Bites,
) -> None:
    """In place, and by scenes of their own; what was cut away comes back, too."""
    head = Operated.of(scene)
    views = outside.with_size(24, 20), inside.with_size(24, 20)
    living = ActiveRayTracer(head.scene, quality, threads=1, cache_cells=cells)
    copied = ActiveRayTracer(head.copy(), quality, threads=1, cache_cells=cells)
    drawn(living, *views), drawn(copied, *views)
    for place, radius, undoes in bites:
        change = head.undo() if undoes else head.bite(place, radius)
        now = head.copy()
        living.update(change)
        copied.replace(now)
        expected = drawn(ActiveRayTracer(now, quality, threads=1), *views)
        for tracer in living, copied:
            for one, other in zip(drawn(tracer, *views), expected, strict=True):
                assert one.tobytes() == other.tobytes()


def test_blood_moves_no_wall(scene: Scene, inside: Camera) -> None:
    head = Operated.of(scene)
    tracer = ActiveRayTracer(head.scene, threads=1)
    before = tracer.gbuffer(inside)
    head.film[...] = 9
    ends = np.zeros(3, np.int64), np.array(head.film.shape[::-1]) - 1
    tracer.update(Change(1, *ends, ChangeKind.FILM))
    assert tracer.gbuffer(inside).depth_mm.tobytes() == before.depth_mm.tobytes()
    assert tracer.report is not None
    assert tracer.report.counters["cells_fetched"] == 0
