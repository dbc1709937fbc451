"""Suite `splats` from end to end on a small ball."""

from contextlib import closing

import numpy as np
import pytest

from benchmarks.plan import Measured, UnavailableError
from benchmarks.scenes import SubjectSource, phantom_subject
from benchmarks.suites.splat_plan import PEER
from benchmarks.suites.splats import (
    SETS,
    SPLAT_VIEWS,
    SplatsPlan,
    threshold_for,
)
from renderers.fsr import FuzzySetRenderer
from renderers.fsr.kernels.footprint import SIGMA_PER_SPACING


def small_plan(ball: SubjectSource, monkeypatch: pytest.MonkeyPatch) -> SplatsPlan:
    monkeypatch.setattr(
        "benchmarks.suites.splats.phantom_subject", lambda spacing_mm: ball.subject
    )
    monkeypatch.setattr("benchmarks.suites.splats.SETS", ((1000, 1.0), (1500, 1.0)))
    monkeypatch.setattr("benchmarks.suites.splats.SIZE", 64)
    monkeypatch.setattr("benchmarks.suites.splats.SPLAT_VIEWS", ("inside",))
    plan = SplatsPlan(quick=True)
    plan.budget_s = 0.0
    return plan


def test_no_eye_stands_among_splats() -> None:
    """The widest splats are those of the fewest; an eye keeps several widths away."""
    count, spacing_mm = SETS[0]
    subject = phantom_subject(spacing_mm)
    renderer = FuzzySetRenderer(
        subject.scene, threshold=threshold_for(subject.scene, count)
    )
    centers = renderer.fuzzy_set.rows.centers_mm()
    sigma_mm = SIGMA_PER_SPACING * spacing_mm
    near = {
        name: np.linalg.norm(centers - view.eye_mm, axis=1).min() / sigma_mm
        for name, view in subject.views.items()
    }
    assert all(near[view] > 4.0 for view in SPLAT_VIEWS)
    assert near["inside"] < 4.0


def test_the_threshold_gives_as_many_splats_as_wanted(ball: SubjectSource) -> None:
    scene = ball.subject.scene
    most = len(FuzzySetRenderer(scene).fuzzy_set)
    for count in (most // 3, most - 1):
        found = FuzzySetRenderer(scene, threshold=threshold_for(scene, count)).fuzzy_set
        same = np.count_nonzero(found.inclusion == found.inclusion.min())
        assert count <= len(found) < count + same
    with pytest.raises(ValueError, match="only"):
        threshold_for(scene, most + 1)


@pytest.mark.slow
def test_every_row_has_its_figures(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: dict[tuple[str, str], Measured] = {}
    with closing(small_plan(ball, monkeypatch)) as plan:
        for task in plan.tasks():
            try:
                found[task.case, task.mode] = task.measure()
            except UnavailableError:
                assert task.mode == PEER
    case = "phantom_1k/inside/shaded"
    one = found[case, "FSR gaussian"]
    assert one.error is not None
    assert one.error.rmse < 0.15
    assert one.counters["fragments"] > 0
    for name in ("2 threads", "2 threads, film"):
        assert found[case, f"FSR gaussian, {name}"].error == one.error
