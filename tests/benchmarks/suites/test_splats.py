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
    plain_extraction,
    threshold_for,
)
from renderers.fsr import FuzzySetRenderer, extract_fuzzy_set
from renderers.fsr.fuzzy_set import BOUNDARY_THRESHOLD, default_inclusion
from renderers.fsr.kernels.footprint import SIGMA_PER_SPACING


def small_plan(ball: SubjectSource, monkeypatch: pytest.MonkeyPatch) -> SplatsPlan:
    scene = ball.subject.scene
    monkeypatch.setattr(
        "benchmarks.suites.splats.phantom_subject", lambda spacing_mm: ball.subject
    )
    monkeypatch.setattr("benchmarks.suites.splats.cube_of_head", lambda size: scene)
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


def test_plain_arrays_find_the_same_voxels(ball: SubjectSource) -> None:
    scene = ball.subject.scene
    inclusion = default_inclusion(scene)
    found = extract_fuzzy_set(scene.volume, inclusion, BOUNDARY_THRESHOLD)
    i, j, k = found.rows.voxels().T
    mask = np.zeros(scene.volume.shape, bool)
    mask[k, j, i] = True
    plain = plain_extraction(scene.volume, inclusion, BOUNDARY_THRESHOLD)
    assert np.count_nonzero(plain != mask) <= 1e-4 * mask.sum()
    assert mask.sum() > 1000


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
    extraction = found["phantom_128/extraction", "FSR extraction"].counters
    assert extraction["voxels that differ"] <= 1e-4 * extraction["splats"]
