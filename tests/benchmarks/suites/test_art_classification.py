"""Suite `art-classification` on a small ball: at equal steps and at equal error."""

import pytest

from benchmarks.plan import Measured
from benchmarks.scenes import SubjectSource
from benchmarks.suites.art_classification import ClassificationPlan, thin_shell

KINDS = ("post", "integrated")


def test_a_thin_shell_is_clear_before_and_behind() -> None:
    film = thin_shell()
    assert film.is_clear(-1000, film.nodes[0])
    assert film.is_clear(film.nodes[-1], 3000)
    assert not film.is_clear(film.nodes[0], film.nodes[-1])


@pytest.mark.slow
def test_rows_are_at_equal_steps_and_at_equal_error(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "benchmarks.suites.art_classification.subjects", lambda quick: (ball,)
    )
    plan = ClassificationPlan(quick=True)
    plan._size, plan._budget_s = 32, 0.0
    found: dict[str, Measured] = {}
    tasks = [t for t in plan.tasks() if t.case == "ball/outside/thin shell"]
    for task in tasks:
        assert task.baseline is None or task.baseline in found
        found[task.mode] = task.measure()
    assert len(found) == 9
    rmse = {name: made.error.rmse for name, made in found.items() if made.error}
    for name in ("preview", "snapshot", "final"):
        assert rmse[f"{name}, integrated"] < rmse[f"{name}, post"] / 2
        likeness = [found[f"{name}, {kind}"].counters["ssim"] for kind in KINDS]
        assert 0 < likeness[0] < likeness[1] < 1
        equal = found[f"post, error of {name}, integrated"]
        assert equal.counters["rmse_of_integrated"] == rmse[f"{name}, integrated"]
        finest = equal.counters["step_voxels"] <= 1 / 64
        assert (
            finest
            or rmse[f"post, error of {name}, integrated"]
            <= (equal.counters["rmse_of_integrated"])
        )
